"""Parameter files of dynparam and rqt_reconfigure: YAML that contains the values as a tagged Python object."""

from __future__ import annotations

from minirospy.base.errors import MinirospyError
from minirospy.base.yaml_text import fast_loader, load_all

__all__ = ["configuration_documents", "parameter_values"]


def configuration_documents(text: str) -> list[object]:
    """Parse a YAML file into documents. Convert a Python object, as written by ROS's dynparam, to a dict.

    Raise MinirospyError if the file is not YAML, or its aliases expand to too much data.
    """
    import yaml

    class Loader(fast_loader()):  # type: ignore[misc]
        pass

    def config(loader: yaml.SafeLoader, _class: str, node: yaml.MappingNode) -> object:
        return loader.construct_mapping(node, deep=True).get("dictitems", {})

    Loader.add_multi_constructor("tag:yaml.org,2002:python/object/new:", config)
    try:
        return [each for each in load_all(text, Loader) if each is not None]
    except yaml.YAMLError as error:
        raise MinirospyError(f"not YAML: {' '.join(str(error).split())}") from error


def parameter_values(text: str) -> dict[str, bool | int | float | str]:
    """Return the parameter values in a file, keyed by name, without group states. Raise MinirospyError if it is invalid."""
    values: dict[str, bool | int | float | str] = {}
    for document in configuration_documents(text):
        if not isinstance(document, dict):
            raise MinirospyError(f"{str(document)[:80]!r} is not a dictionary of values")
        for name, value in document.items():
            if isinstance(value, bool | int | float):
                values[str(name)] = value
            elif value is not None and not isinstance(value, dict | list):
                values[str(name)] = str(value)
    return values
