"""Worker processes: how they begin, are watched and end with their parent."""

from irtrack.workers.asking import answer_or_blame
from irtrack.workers.beginning import one_thread
from irtrack.workers.blame import Blame, Deaths
from irtrack.workers.board import Board, Unwatched, Watch
from irtrack.workers.gone import GoneError, NotSentError
from irtrack.workers.limit import NO_LIMIT, Limit
from irtrack.workers.pool import Pool
from irtrack.workers.watched import Watched

__all__ = [
    "NO_LIMIT",
    "Blame",
    "Board",
    "Deaths",
    "GoneError",
    "Limit",
    "NotSentError",
    "Pool",
    "Unwatched",
    "Watch",
    "Watched",
    "answer_or_blame",
    "one_thread",
]
