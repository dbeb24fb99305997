"""urdf_parser_py.xml_reflection: objects that are read from XML and written to it."""
