"""catkin_pkg.python_setup: provides the arguments for setup() that are defined in package.xml.

Source: http://docs.ros.org/en/noetic/api/catkin/html/user_guide/setup_dot_py.html.
"""

from __future__ import annotations

from minirospy.ros.catkin_pkg.catkin_pkg.package import InvalidPackage, Person, parse_package

__all__ = ["InvalidPackage", "generate_distutils_setup", "parse_package"]


def generate_distutils_setup(package_xml_path: str = ".", **kwargs: object) -> dict[str, object]:
    """Return the arguments for setup(). Raise InvalidPackage if a given argument differs from package.xml."""
    package = parse_package(package_xml_path)
    found: dict[str, object] = {
        "name": package.name,
        "version": package.version,
        **_persons("maintainer", package.maintainers),
        **_persons("author", package.authors),
        "description": package.plaintext_description,
        "license": ", ".join(package.licenses),
    }
    website = next((url.url for url in package.urls if url.type == "website"), None)
    if website is not None:
        found["url"] = website
    for name, value in kwargs.items():
        if name in found and found[name] != value:
            raise InvalidPackage(
                f'The keyword argument "{name}" does not match the information from package.xml: '
                f'"{value}" != "{found[name]}"',
                package_xml_path,
            )
        found[name] = value
    return found


def _persons(kind: str, persons: list[Person]) -> dict[str, object]:
    if len(persons) != 1:
        return {kind: ", ".join(map(str, persons))} if persons else {}
    email = persons[0].email
    return {kind: persons[0].name, **({f"{kind}_email": email} if email is not None else {})}
