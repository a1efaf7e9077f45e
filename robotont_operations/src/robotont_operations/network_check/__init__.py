"""The parts of the network check, each a question of its own; ../network.py asks them, most of them at once.

findings: the lines of the report. master: whether it answers, and which nodes it lists. other_nodes: whether those of
other machines answer. announced_address: where others look for this machine's nodes. way_back: whether the master's
machine reaches this one. clock: whether another machine's agrees. Each tells its findings to a function `report`.
"""
