"""One module per node, named after it: topics in, topics out. `scripts/robotont_node` runs all three in one process."""
