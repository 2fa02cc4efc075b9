"""What is wrong with the words of a command, on one line."""

from __future__ import annotations

from typing import Any

_WANTED = {
    "greater_than_equal": "{ge} or more",
    "int_parsing": "a whole number",
    "int_from_float": "a whole number",
    "float_parsing": "a number",
}
"""How pydantic's errors go on after 'must be'."""


def usage_line(error: Any) -> str:
    """One line of typer's UsageError: '--jobs: must be 1 or more, not 0'.

    Older versions of typer say it in words of their own, which then stand behind the option's name.
    """
    from irsim.config.base import suggestion

    command = error.ctx.command if error.ctx is not None else None
    hint = f"; see {error.ctx.command_path} --help" if error.ctx is not None else ""
    option = getattr(error, "option_name", None)
    if hasattr(error, "possibilities"):
        known = [word for param in getattr(command, "params", ()) for word in param.opts]
        return f"{option}: no such option{suggestion(option, known) or hint}"
    if option is not None:
        return f"{option}: {_clause(error.message).removeprefix(f'option {option!r} ')}"
    param = getattr(error, "param", None)
    if param is None:
        return _clause(error.message) + hint
    name = max(param.opts, key=len) if param.param_type_name == "option" else param.metavar or param.name
    if not error.message:
        return f"{name}: is missing{_words(param)}{hint}"
    for detail in getattr(error.__cause__, "errors", list)():
        if detail["type"] in _WANTED:
            wanted = _WANTED[detail["type"]].format(**detail.get("ctx", {}))
            return f"{name}: must be {wanted}, not {detail['input']}"
    return f"{name}: {_clause(error.message)}"


def _words(param: Any) -> str:
    """'; allowed: a, b or c' of an argument whose help lists its words, and so begins with a small letter."""
    help = getattr(param, "help", None) or ""
    return f"; allowed: {_clause(help)}" if help[:1].islower() else ""


def _clause(sentence: str) -> str:
    return sentence[:1].lower() + sentence[1:].rstrip(".")
