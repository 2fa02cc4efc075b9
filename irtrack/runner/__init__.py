"""Worker processes: how they begin, are watched and end with their parent."""

from irtrack.runner.asking import answer_or_blame
from irtrack.runner.beginning import one_thread
from irtrack.runner.blame import Blame, Deaths
from irtrack.runner.board import Board, Unwatched, Watch
from irtrack.runner.gone import GoneError, NotSentError
from irtrack.runner.limit import NO_LIMIT, Limit
from irtrack.runner.pool import Pool
from irtrack.runner.watched import Watched

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
