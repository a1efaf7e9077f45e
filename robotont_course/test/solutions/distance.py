def drive(command, robot):
    ahead = robot.ahead
    if ahead < 0:  # too near to be measured
        ahead = 0.3
    command.linear.x = max(-0.3, min(0.3, 1.5 * (ahead - 0.6)))
    if abs(ahead - 0.6) < 0.02:
        command.linear.x = 0.0
