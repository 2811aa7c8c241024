"""Options declared once: a dataclass parameter of a command becomes one command-line option per field.

typer reads a flat signature.  `expanded` gives it one: every parameter annotated with a dataclass is replaced by keyword
parameters for the fields of that dataclass, and the command is called with the dataclass built from them.  Thirty lines
keep typer, its start-up time and its help texts; cyclopts and tyro nest dataclasses but would replace all of them.
"""

import inspect
from collections.abc import Callable
from dataclasses import MISSING, fields, is_dataclass


def expanded(command: Callable[..., None]) -> Callable[..., None]:
    """Return the command with a flat signature for typer.  Raises TypeError when two parameters have one name."""
    signature = inspect.signature(command, eval_str=True)
    own = signature.parameters.values()
    groups = {one.name: one.annotation for one in own if _is_group(one.annotation)}
    if not groups:
        return command
    flat = [one.replace(kind=inspect.Parameter.KEYWORD_ONLY) for one in own if one.name not in groups]
    flat += [parameter for group in groups.values() for parameter in _parameters(group)]
    names = [one.name for one in flat]
    if len(set(names)) < len(names):
        raise TypeError(f"{command.__name__}: two parameters have one name: {', '.join(names)}")
    members = {name: [field.name for field in fields(group)] for name, group in groups.items()}

    def flat_command(**values: object) -> None:
        built = {name: groups[name](**{member: values.pop(member) for member in members[name]}) for name in groups}
        command(**values, **built)

    flat_command.__name__ = command.__name__
    flat_command.__doc__ = command.__doc__
    flat_command.__annotations__ = {one.name: one.annotation for one in flat}
    setattr(flat_command, "__signature__", signature.replace(parameters=flat))  # noqa: B010 - not declared for functions
    return flat_command


def _is_group(annotation: object) -> bool:
    return isinstance(annotation, type) and is_dataclass(annotation)


def _parameters(group: type) -> list[inspect.Parameter]:
    """One keyword parameter per field of the dataclass, with the field's annotation and default."""
    annotations = inspect.get_annotations(group, eval_str=True)
    return [
        inspect.Parameter(
            field.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=inspect.Parameter.empty if field.default is MISSING else field.default,
            annotation=annotations[field.name],
        )
        for field in fields(group)
    ]
