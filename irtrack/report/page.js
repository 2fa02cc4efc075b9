// Plays the replays of the page. Each <div class="replay"> holds its data as JSON and what is drawn on.
"use strict";

const LIGHT_GREY = "rgba(128, 128, 128, .35)";
const KEYS = "Keys: ← → one frame, with shift ten; space plays; home, end; L next loss; Z enlarges.";

function openReplay(root) {
  const data = JSON.parse(root.querySelector("script").textContent);
  const last = data.indices.length - 1;
  const many = data.tracks !== undefined, trackers = many ? [] : data.trackers;
  const find = (name) => root.querySelector(`.${name}`);
  const stage = find("stage"), line = find("line"), slider = find("slider"), play = find("play");
  const zoom = find("zoom"), truthShown = find("show-truth"), particlesShown = find("show-particles");
  const shown = [...root.querySelectorAll(".show-tracker")];
  const cells = [...root.querySelectorAll("tbody tr")].map((row) => [...row.querySelectorAll("td")]);
  const pictures = new Map();
  let at = 0, timer = null;

  // A few pictures are kept decoded; the rest stay text.
  function picture(k) {
    if (!pictures.has(k)) {
      const image = new Image();
      image.onload = () => { if (k === at) draw(); };
      image.src = `data:image/jpeg;base64,${data.pictures[k]}`;
      pictures.set(k, image);
      if (pictures.size > 64) pictures.delete(pictures.keys().next().value);
    }
    return pictures.get(k);
  }

  // The part of the frame that is shown, px of the frame: all of it, or what is around the target.
  function view() {
    const [columns, rows] = data.size;
    if (!zoom.checked) return { x: 0, y: 0, w: columns, h: rows };
    const boxes = many ? [] : [data.truth.boxes[at], ...trackers.map((one) => one.boxes[at])];
    const middle = boxes.find((box) => box) || [columns / 2, rows / 2, 1, 1];
    const w = Math.min(columns, Math.max(many ? columns / 3 : 48, 8 * Math.max(middle[2], middle[3])));
    const h = w * rows / columns;
    const inside = (value, size, all) => Math.min(Math.max(value - size / 2, 0), all - size);
    return { x: inside(middle[0] + .5, w, columns), y: inside(middle[1] + .5, h, rows), w, h };
  }

  function draw() {
    const image = picture(at);
    if (at < last) picture(at + 1);
    const ratio = window.devicePixelRatio || 1;
    const width = Math.round(stage.clientWidth * ratio);
    const height = Math.round(width * data.size[1] / data.size[0]);
    if (stage.width !== width || stage.height !== height) { stage.width = width; stage.height = height; }
    const pen = stage.getContext("2d"), part = view(), scale = width / part.w;
    const shrunk = (image.naturalWidth || data.size[0]) / data.size[0];
    pen.imageSmoothingEnabled = false;
    if (image.complete && image.naturalWidth) {
      pen.drawImage(image, part.x * shrunk, part.y * shrunk, part.w * shrunk, part.h * shrunk, 0, 0, width, height);
    }
    const place = (x, y) => [(x + .5 - part.x) * scale, (y + .5 - part.y) * scale];
    trackers.forEach((tracker, n) => {
      if (!shown[n].checked) return;
      if (particlesShown && particlesShown.checked && tracker.particles && tracker.particles[at]) {
        drawParticles(pen, tracker, place, ratio);
      }
      drawBox(pen, tracker.boxes[at], tracker.color, tracker.dash, place, scale, ratio);
    });
    if (truthShown && truthShown.checked) {
      for (const box of many ? data.truth.boxes[at] : [data.truth.boxes[at]]) {
        if (!many) drawBox(pen, box, "#000", [], place, scale, 2 * ratio);
        drawBox(pen, box, "#fff", [5, 4], place, scale, many ? ratio / 2 : ratio);
      }
    }
    if (many) drawTracks(pen, place, scale, ratio);
  }

  // Boxes in the colours of the identities, with their numbers; those of predicted positions are dashed.
  function drawTracks(pen, place, scale, ratio) {
    pen.font = `${11 * ratio}px system-ui, sans-serif`;
    data.tracks[at].forEach(([n, x, y, w, h, seen]) => {
      const { id, color, dash } = data.identities[n];
      drawBox(pen, [x, y, w, h], color, seen ? dash : [2, 3], place, scale, ratio);
      const [left, top] = place(x + w / 2, y - h / 2);
      pen.setLineDash([]);
      pen.strokeStyle = "#000";
      pen.strokeText(id, left + 6 * ratio, top);
      pen.fillStyle = "#fff";
      pen.fillText(id, left + 6 * ratio, top);
    });
  }

  function drawBox(pen, box, color, dash, place, scale, thick) {
    if (!box) return;
    const least = zoom.checked ? 0 : 12 * thick / scale; // in the whole frame a small box is a mark
    const w = Math.max(box[2], least), h = Math.max(box[3], least);
    const [x, y] = place(box[0] - w / 2, box[1] - h / 2);
    pen.strokeStyle = color;
    pen.lineWidth = 2 * thick;
    pen.setLineDash(dash.map((length) => length * thick));
    pen.strokeRect(x, y, w * scale, h * scale);
  }

  function drawParticles(pen, tracker, place, ratio) {
    const bytes = Uint8Array.from(atob(tracker.particles[at]), (letter) => letter.charCodeAt(0));
    const grid = new Uint16Array(bytes.buffer);
    const points = [];
    for (let n = 0; n < grid.length; n += 2) {
      points.push(place(grid[n] / 65535 * data.size[0] - .5, grid[n + 1] / 65535 * data.size[1] - .5));
    }
    for (const [color, side] of [["#000", 5 * ratio], [tracker.color, 3 * ratio]]) {
      pen.fillStyle = color;
      points.forEach(([x, y]) => pen.fillRect(x - side / 2, y - side / 2, side, side));
    }
  }

  // One row a tracker: thick where it is on the target, thin where off; grey behind where the target is hidden.
  function drawLine() {
    const ratio = window.devicePixelRatio || 1, rows = many ? data.lanes.length : trackers.length;
    const high = many && rows > 12 ? 5 : 10, row = high * ratio;
    line.width = Math.round(line.clientWidth * ratio);
    line.height = Math.round(row * rows);
    line.style.height = `${high * rows}px`;
    const pen = line.getContext("2d"), edge = (k) => Math.round(k * line.width / (last + 1));
    const fill = (k, y, high) => pen.fillRect(edge(k), y, edge(k + 1) - edge(k), high);
    if (many) {
      data.lanes.forEach((lane, n) => lane.forEach((own, k) => {
        if (own === -1) return;
        pen.fillStyle = own === null ? LIGHT_GREY : data.identities[own].color;
        fill(k, n * row + row * .2, row * .6);
      }));
    }
    pen.fillStyle = LIGHT_GREY;
    (data.truth.visible || []).forEach((visible, k) => {
      if (!data.truth.boxes[k] || (visible !== null && visible < .5)) fill(k, 0, line.height);
    });
    trackers.forEach((tracker, n) => {
      pen.fillStyle = tracker.color;
      tracker.boxes.forEach((box, k) => {
        if (!box) return;
        const high = tracker.off[k] ? 2 * ratio : 6 * ratio;
        fill(k, n * row + (row - high) / 2, high);
      });
    });
    find("cursor").style.left = `${100 * (at + .5) / (last + 1)}%`;
  }

  function tell() {
    const seconds = data.times[at].toFixed(2);
    const told = many ? null : data.truth.visible[at];
    const right = many ? data.lanes.filter((lane) => lane[at] !== null && lane[at] >= 0).length : 0;
    const seen = many ? `, ${right} of ${data.truth.boxes[at].length} targets tracked, ${data.tracks[at].length} tracks`
      : !data.truth.boxes.some((box) => box) ? "" : !data.truth.boxes[at] ? ", target absent"
      : told !== null && told < 1 ? `, ${Math.round(100 * told)} % of the target visible` : "";
    find("when").textContent = `frame ${data.indices[at]}, ${seconds} s${seen}`;
    slider.value = at;
    slider.setAttribute("aria-valuetext", find("when").textContent);
    const number = (list, digits) => !list || list[at] === null ? "–" : list[at].toFixed(digits);
    trackers.forEach((tracker, n) => {
      const lost = tracker.lost !== null && data.indices[at] >= tracker.lost;
      cells[n][0].textContent = tracker.status[at] || "not started";
      cells[n][1].textContent = number(tracker.errors, 1) + (lost ? " lost" : tracker.off[at] ? " off" : "");
      cells[n][1].classList.toggle("bad", lost || tracker.off[at]);
      cells[n][2].textContent = number(tracker.scores, 2);
      cells[n][3].textContent = number(tracker.neffs, 0);
    });
    find("cursor").style.left = `${100 * (at + .5) / (last + 1)}%`;
  }

  function go(k) {
    at = Math.min(Math.max(k, 0), last);
    tell();
    draw();
  }

  function pause() {
    clearInterval(timer);
    timer = null;
    play.textContent = "Play";
  }

  function toggle() {
    if (timer !== null) { pause(); return; }
    if (at === last) at = 0;
    play.textContent = "Pause";
    const stride = last ? (data.indices[last] - data.indices[0]) / last : 1;
    timer = setInterval(() => { if (at === last) pause(); else go(at + 1); }, 1000 * stride / Math.min(data.rate, 30));
  }

  function nextLoss() {
    const losses = (many ? data.switches : trackers.map((one) => one.lost)).filter((lost) => lost !== null)
      .map((lost) => data.indices.findIndex((index) => index >= lost)).filter((k) => k >= 0).sort((a, b) => a - b);
    const next = losses.find((k) => k > at);
    if (losses.length) go(next === undefined ? losses[0] : next);
  }

  const keys = {
    ArrowLeft: (event) => go(at - (event.shiftKey ? 10 : 1)),
    ArrowRight: (event) => go(at + (event.shiftKey ? 10 : 1)),
    Home: () => go(0),
    End: () => go(last),
    " ": toggle,
    l: nextLoss,
    z: () => { zoom.checked = !zoom.checked; draw(); },
  };

  root.addEventListener("keydown", (event) => {
    const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    const own = event.key === " " && (event.target.type === "checkbox" || event.target.tagName === "BUTTON");
    if (!act || own || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    if (event.key !== " ") pause();
    act(event);
  });
  slider.addEventListener("input", () => { pause(); go(Number(slider.value)); });
  play.addEventListener("click", toggle);
  find("loss").addEventListener("click", () => { pause(); nextLoss(); });
  root.querySelectorAll("input[type=checkbox]").forEach((box) => box.addEventListener("change", draw));
  line.addEventListener("click", (event) => {
    pause();
    go(Math.floor((last + 1) * event.offsetX / line.clientWidth));
  });
  find("keys").textContent = many ? KEYS.replace("L next loss", "L next switch") : KEYS;
  find("loss").disabled = many ? !data.switches.length : trackers.every((one) => one.lost === null);
  slider.max = last;
  new ResizeObserver(() => { draw(); drawLine(); }).observe(root);
  go(0);
  drawLine();
}

// A replay is decoded when it comes into sight.
const watcher = new IntersectionObserver((entries) => entries.forEach((entry) => {
  if (!entry.isIntersecting) return;
  watcher.unobserve(entry.target);
  openReplay(entry.target);
}), { rootMargin: "400px" });
document.querySelectorAll(".replay").forEach((root) => watcher.observe(root));
