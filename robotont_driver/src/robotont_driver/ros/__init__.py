"""What nodes are made of: start and end, parameters, diagnostics, threads; parts that one node has of its own."""
