"""One module per node: topics in, topics out. `topic(name)` makes a topic of packets, of ros/packet_topics."""
