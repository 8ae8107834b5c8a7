"""The reference of the command line, made from the commands themselves."""

from __future__ import annotations

from typing import Any

from typer.main import get_command

from fragfield.cli import app

__all__ = ["command_reference"]


def command_reference() -> str:
    """Every subcommand with its arguments and options, as Markdown."""
    commands: dict[str, Any] = get_command(app).commands  # type: ignore[attr-defined]
    return "\n\n".join(_section(name, command) for name, command in commands.items())


def _section(name: str, command: Any) -> str:  # noqa: ANN401 - click's
    lines = [f"## {name}", "", command.help or "", "", "| argument | meaning |", "|---|---|"]
    lines += [f"| `{_spelling(entry)}` | {getattr(entry, 'help', '') or ''} |" for entry in command.params]
    return "\n".join(lines)


def _spelling(parameter: Any) -> str:  # noqa: ANN401 - click's
    if parameter.param_type_name == "argument":
        return parameter.metavar or parameter.name.upper()
    names = ", ".join(sorted((*parameter.opts, *parameter.secondary_opts), key=len))
    takes = "" if parameter.is_flag else f" {parameter.metavar or parameter.type.name.upper()}"
    return names + takes
