"""Pure tables of the computation graph: calls in, (answer, actions) out."""
