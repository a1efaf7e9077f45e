"""How what users set is described and read: tables of parameters, command lines, files.

In go values out of YAML files or from the parameter server. Out come checked values, or errors that say what was found,
what is allowed and where.
"""
