"""Pure tables of the computation graph: methods take a call and return its response and actions."""
