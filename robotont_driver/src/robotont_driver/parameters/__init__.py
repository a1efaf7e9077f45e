"""What users may set: its name, default, unit and bounds.

In go values out of YAML files or from the parameter server. Out come checked values, or errors that say what was found,
what is allowed and where.
"""
