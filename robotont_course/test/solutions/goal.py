import collections
import math

CELL = 0.1
GOAL = 3.5, 2.5
plan = []


def near_free(x, y):
    return all(free(x + 0.22 * math.cos(k), y + 0.22 * math.sin(k)) for k in range(7)) if free else False


def find(start):
    """Breadth first, over cells of 0.1 m that keep 0.22 m off everything."""
    first = round(start[0] / CELL), round(start[1] / CELL)
    last = round(GOAL[0] / CELL), round(GOAL[1] / CELL)
    before, ahead = {first: None}, collections.deque([first])
    while ahead and last not in before:
        cell = ahead.popleft()
        for step in ((1, 0), (0, 1), (-1, 0), (0, -1)):
            new = cell[0] + step[0], cell[1] + step[1]
            if new not in before and near_free(new[0] * CELL, new[1] * CELL):
                before[new] = cell
                ahead.append(new)
    way = [last]
    while before[way[-1]]:
        way.append(before[way[-1]])
    return [(column * CELL, row * CELL) for column, row in reversed(way)]


free = None


def drive(command, robot):
    global free
    free = robot.free
    x, y, yaw = robot.on_map
    if not plan:
        plan.extend(find((x, y)))
    while len(plan) > 1 and math.hypot(plan[0][0] - x, plan[0][1] - y) < 0.12:
        plan.pop(0)
    to_x, to_y = plan[0][0] - x, plan[0][1] - y
    distance = math.hypot(to_x, to_y)
    if len(plan) == 1 and distance < 0.05:
        return
    speed = min(0.3, 0.1 + distance) / max(distance, 0.01)
    command.linear.x = speed * (math.cos(yaw) * to_x + math.sin(yaw) * to_y)
    command.linear.y = speed * (-math.sin(yaw) * to_x + math.cos(yaw) * to_y)
