import math


def drive(command, robot):
    seen = robot.see(1)
    if not seen:
        return
    x, y, out = seen
    facing = math.atan2(math.sin(out + math.pi), math.cos(out + math.pi))  # 0 when it looks straight at us
    bearing = math.atan2(y, x)
    side = y - x * math.tan(facing) if x > 0.9 else y
    command.linear.x = max(-0.3, min(0.3, x - 0.6))
    command.linear.y = 0.0 if x > 2 else max(-0.1, min(0.1, 0.6 * side))
    command.angular.z = 1.2 * bearing
    if abs(x - 0.6) < 0.03 and abs(y) < 0.03 and abs(bearing) < 0.06:
        command.linear.x = command.linear.y = command.angular.z = 0.0
