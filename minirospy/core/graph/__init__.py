"""Pure tables of the computation graph: calls in, (response, actions) out."""
