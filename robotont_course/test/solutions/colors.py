import numpy as np


def drive(command, robot):
    picture, ahead = robot.picture, robot.ahead
    red = (picture[..., 0] > 80) & (picture[..., 1] < 50) & (picture[..., 2] < 50)
    if red.sum() < 30:
        command.angular.z = 0.8
        return
    off = (picture.shape[1] / 2 - np.nonzero(red)[1].mean()) / picture.shape[1]
    command.angular.z = 2.0 * off
    if abs(off) < 0.05:
        command.linear.x = max(-0.3, min(0.3, ahead - 0.55))
        if abs(ahead - 0.55) < 0.03:
            command.linear.x = command.angular.z = 0.0
