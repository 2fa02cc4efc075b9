"""Tables of a results file, as SQL."""

APPLICATION_ID = 0x69727472
"""'irtr' in the header of the file, which marks a results file."""

SCHEMA_VERSION = 8
"""Number to increase with every change of a table below. A new figure changes no table: it is a row of `scores`."""

SCHEMA = f"""
BEGIN IMMEDIATE;
PRAGMA application_id = {APPLICATION_ID};
PRAGMA user_version = {SCHEMA_VERSION};
-- crc: checksum of the row (`irtrack.bench.results.checksum`), of a cell with its scores and without its trace, whose
-- stream has its own.
CREATE TABLE runs (id INTEGER PRIMARY KEY, started TEXT NOT NULL, command TEXT, versions TEXT NOT NULL,
    crc INTEGER NOT NULL);
CREATE TABLE sources (
    hash TEXT NOT NULL, scene_hash TEXT NOT NULL, name TEXT NOT NULL, kind TEXT NOT NULL, text TEXT NOT NULL,
    word TEXT NOT NULL, columns INTEGER NOT NULL, rows INTEGER NOT NULL, rate_hz REAL NOT NULL, length INTEGER NOT NULL,
    changes TEXT NOT NULL, severity INTEGER, crc INTEGER NOT NULL,
    PRIMARY KEY (name, hash)
);
CREATE TABLE cells (
    digest TEXT PRIMARY KEY,
    source_hash TEXT NOT NULL, target TEXT, start TEXT NOT NULL, input TEXT NOT NULL,
    scene_seed INTEGER, tracker_seed INTEGER NOT NULL, config TEXT NOT NULL, code_hash TEXT NOT NULL,
    task TEXT NOT NULL, weights TEXT NOT NULL,
    status TEXT NOT NULL, failure TEXT, outcome TEXT, trace BLOB, crc INTEGER NOT NULL
);
CREATE TABLE scores (
    digest TEXT NOT NULL REFERENCES cells (digest), name TEXT NOT NULL, value REAL,
    PRIMARY KEY (digest, name)
) WITHOUT ROWID;
-- Which cells a run wanted, of which source under which label, whether it had to compute them or found them here.
CREATE TABLE wanted (
    run INTEGER NOT NULL REFERENCES runs (id), source TEXT NOT NULL, label TEXT NOT NULL, digest TEXT NOT NULL,
    crc INTEGER NOT NULL, PRIMARY KEY (run, source, label, digest)
);
COMMIT;
"""

BOUNDS_TABLE = """
CREATE TABLE IF NOT EXISTS bounds (
    source_hash TEXT NOT NULL, target TEXT NOT NULL, data BLOB NOT NULL, PRIMARY KEY (source_hash, target)
)
"""
"""Table of bounds, created when the first bounds are stored; a file without bounds has no such table."""

EXPLANATIONS_TABLE = "CREATE TABLE IF NOT EXISTS explanations (digest TEXT PRIMARY KEY, data TEXT NOT NULL)"
"""Table of explanations of lost runs, created when the first is stored."""
