"""Motors that follow at once, for mock_serial_node."""


class IdealMotors:
    """Wheels that turn exactly as commanded; encoders that count whole edges and lose none."""

    def __init__(self, wheels):
        self.turned = [0.0] * wheels  # [edges] since the start
        self.counted = [0] * wheels   # [edges] the same as counted by the encoders

    def follow(self, units):
        """Counts, one per wheel, of one PID period in which each wheel keeps its speed [units]."""
        self.turned = [turned + unit for turned, unit in zip(self.turned, units)]
        totals = [round(turned) for turned in self.turned]
        counts = [total - before for total, before in zip(totals, self.counted)]
        self.counted = totals
        return counts
