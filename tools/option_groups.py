"""Options declared once: a dataclass parameter of a command becomes one command-line option per field.

typer reads a flat signature.  `expanded` gives it one: every parameter annotated with a dataclass is replaced by keyword
parameters for the fields of that dataclass, and the command is called with the dataclass built from them.  Thirty lines
keep typer, its start-up time and its help texts; cyclopts and tyro nest dataclasses but would replace all of them.

`Annotated[Options, EXPERT]` puts the fields into a panel of the help; then options without a panel are in that of the
common ones.  A dataclass with a PANEL is in that one, wherever it is used.
"""

import inspect
from collections.abc import Callable, Iterator
from copy import copy
from dataclasses import MISSING, field, fields, is_dataclass
from typing import Annotated, Any

import typer
from typer.core import TyperCommand
from typer.models import OptionInfo

PANELS = COMMON, EXPERT, RESEARCH = "Common options", "Expert options", "Research options"


def option(default: Any, help: str, *names: str, **settings: Any) -> Any:
    """Field of a dataclass that is an option, with a default; named as the field unless `names` are given.

    settings: of `typer.Option`.  A flag that is off by default has no opposite.
    """
    return field(default=default, metadata={"names": names, "settings": {"help": help, **settings}})


class PanelCommand(TyperCommand):
    """A command whose `--help` is among the common options, where these have a panel."""

    def get_help_option(self, ctx: typer.Context) -> object:  # type: ignore[override]  # of private types
        option = super().get_help_option(ctx)
        if option is not None and any(getattr(one, "rich_help_panel", None) == COMMON for one in self.params):
            option.rich_help_panel = COMMON
        return option


def add_command(app: typer.Typer, command: Callable[..., None], name: str | None = None, panel: str | None = None) -> None:
    """Add a command, of its function's name unless another one is given.  panel: of the help of `app`."""
    app.command(name or command.__name__, cls=PanelCommand, rich_help_panel=panel)(expanded(command))


def expanded(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with a flat signature for typer.  Raises TypeError when two parameters have one name."""
    signature = inspect.signature(command, eval_str=True)
    own = signature.parameters.values()
    groups = {one.name: found for one in own if (found := _group(one.annotation))}
    if not groups:
        return command
    common = COMMON if any(panel in PANELS for _, panel in groups.values()) else None
    flat = [
        one.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=_in_panel(one.annotation, common))
        for one in own
        if one.name not in groups
    ]
    flat += [parameter for group, panel in groups.values() for parameter in _parameters(group, panel or common)]
    flat.sort(key=_place)
    names = [one.name for one in flat]
    if len(set(names)) < len(names):
        raise TypeError(f"{command.__name__}: two parameters have one name: {', '.join(names)}")
    members = {name: [one.name for one in fields(group)] for name, (group, _) in groups.items()}

    def flat_command(**values: object) -> None:
        built = {name: groups[name][0](**{member: values.pop(member) for member in members[name]}) for name in groups}
        command(**values, **built)

    flat_command.__name__ = command.__name__
    flat_command.__doc__ = command.__doc__
    flat_command.__annotations__ = {one.name: one.annotation for one in flat}
    setattr(flat_command, "__signature__", signature.replace(parameters=flat))  # noqa: B010 - not declared for functions
    return flat_command


def _group(annotation: object) -> tuple[type, str | None] | None:
    """The dataclass of a parameter, and its panel; None for a parameter that is an option itself."""
    (panel,) = getattr(annotation, "__metadata__", (None,))
    inner = getattr(annotation, "__origin__", annotation)
    if not (isinstance(inner, type) and is_dataclass(inner)):
        return None
    return inner, panel or getattr(inner, "PANEL", None)


def _parameters(group: type, panel: str | None) -> Iterator[inspect.Parameter]:
    """One keyword parameter per field of the dataclass, with the field's type, option and default."""
    annotations: dict[str, Any] = {}
    for base in reversed(group.__mro__):
        annotations |= inspect.get_annotations(base, eval_str=True)
    for one in fields(group):
        annotation, settings = annotations[one.name], one.metadata.get("settings")
        if settings is None:
            annotation = _in_panel(annotation, panel)
        else:
            names = one.metadata["names"] or ((f"--{one.name.replace('_', '-')}",) if one.default is False else ())
            annotation = Annotated[annotation, typer.Option(*names, **{"rich_help_panel": panel} | settings)]
        default = inspect.Parameter.empty if one.default is MISSING else one.default
        yield inspect.Parameter(one.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def _place(parameter: inspect.Parameter) -> int:
    """Order of the panels: arguments and common options first, options of all commands last."""
    (option,) = getattr(parameter.annotation, "__metadata__", (None,))
    panel = getattr(option, "rich_help_panel", None)
    return PANELS.index(panel) if panel in PANELS else len(PANELS) if panel else 0


def _in_panel(annotation: Any, panel: str | None) -> Any:
    """The option in that panel of the help; as it is without a panel, or if it is an argument or has one."""
    for option in getattr(annotation, "__metadata__", ()):
        if panel and isinstance(option, OptionInfo) and not option.rich_help_panel:
            option = copy(option)
            option.rich_help_panel = panel
            return Annotated[annotation.__origin__, option]
    return annotation
