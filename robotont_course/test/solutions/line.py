import numpy as np


def drive(command, robot):
    picture = robot.picture
    rows = picture[150:]
    yellow = (rows[..., 0] > 90) & (rows[..., 1] > 80) & (rows[..., 2] < 60)
    if yellow.sum() < 60:
        return
    columns = np.nonzero(yellow)[1]
    off = (picture.shape[1] / 2 - columns.mean()) / picture.shape[1]
    command.linear.x = 0.2
    command.angular.z = 3.0 * off
