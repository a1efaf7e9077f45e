"""Command lines of programs with options: `--name value`, `--name=value` and, as in launch files, `name:=value`."""

import argparse
import re
import sys

from robotont_driver.parameters.parameters import nearest


class ArgumentParser(argparse.ArgumentParser):
    """As argparse's, but also takes its options as name:=value, and tells the nearest to an unknown one."""

    def __init__(self, **words):
        super().__init__(allow_abbrev=False, **words)

    def parse_args(self, args=None, namespace=None):
        """As argparse's."""
        words = [self._as_option(word) for word in (sys.argv[1:] if args is None else args)]
        options, unknown = self.parse_known_args([word for word in words if word], namespace)
        if unknown:
            name = re.split("=", unknown[0])[0]
            self.error(f"no argument {name}" + (nearest(name, self._option_string_actions) or f"; see {self.prog} -h"))
        return options

    def _as_option(self, word):
        """`--name=value` for `name:=value`; `--name` alone, or nothing, for a switch that is true or false."""
        name, assigned, value = word.partition(":=")
        if not assigned or not re.fullmatch("[A-Za-z][A-Za-z0-9_-]*", name):
            return word
        option = next((known for known in ("--" + name, "--" + name.replace("_", "-"))
                       if known in self._option_string_actions), None)
        if option is None:
            return f"--{name}={value}"
        if self._option_string_actions[option].nargs == 0:
            return option if value == "true" else "" if value == "false" else f"{option}={value}"
        return f"{option}={value}"
