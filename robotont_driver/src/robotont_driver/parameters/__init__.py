"""How what users set is described, read and checked: tables of parameters, command lines, files."""
