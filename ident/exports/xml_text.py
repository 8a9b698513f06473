"""A tree of XML as the text of a file."""

from __future__ import annotations

from xml.etree import ElementTree as xml


def xml_text(root: xml.Element) -> str:
    """Declaration and indented elements; the tree is indented with it."""
    xml.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + xml.tostring(root, encoding="unicode") + "\n"
