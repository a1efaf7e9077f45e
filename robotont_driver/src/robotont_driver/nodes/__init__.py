"""One module per node, named after it: topics in, topics out. `robotont_node` runs three of them in one process."""
