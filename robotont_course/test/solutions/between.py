blind = 0


def drive(command, robot):
    """Towards the middle between both, as long as both are seen; then straight on."""
    global blind
    near = [angle for angle, distance in robot.points if distance < 2.2]
    if not blind and near and near[-1] - near[0] > 0.3:
        command.linear.x = 0.3
        command.angular.z = 1.5 * (near[0] + near[-1]) / 2
    else:
        blind += 1
        command.linear.x = 0.3 if blind < 80 else 0.0
