"""urdf_parser_py.xml_reflection: objects that can be read from XML and written to it."""
