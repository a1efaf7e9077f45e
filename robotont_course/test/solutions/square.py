import math

corners, start = [(1, 0), (1, 1), (0, 1), (0, 0)], []


def drive(command, robot):
    x, y, yaw = robot.odometry
    start[:] = start or [x, y, yaw]
    if not corners:
        return
    cos, sin = math.cos(start[2]), math.sin(start[2])
    goal_x = start[0] + cos * corners[0][0] - sin * corners[0][1] - x
    goal_y = start[1] + sin * corners[0][0] + cos * corners[0][1] - y
    distance = math.hypot(goal_x, goal_y)
    if distance < 0.03:
        corners.pop(0)
        return
    speed = min(0.3, distance) / distance
    command.linear.x = speed * (math.cos(yaw) * goal_x + math.sin(yaw) * goal_y)
    command.linear.y = speed * (-math.sin(yaw) * goal_x + math.cos(yaw) * goal_y)
