"""Random outages between a commander and a driver, with a model of TCP: for how long a command moves the robot."""

import heapq
import itertools
import random

import pytest

from robotont_driver.command.message_age import Link
from robotont_driver.ros.reconnection import ANSWER_WITHIN, PERIOD

TIMEOUT, TRIP = 0.5, 0.01    # [s]
FIRST_RETRIES = 0.03, 0.2    # [s] of a link such as Wi-Fi, of TCP
SEGMENT = 20                 # small messages in one, when they are sent again


class History:
    """Outages, the times of a commander's messages until it dies, and when TCP delivers them."""

    def __init__(self, seed, rate):
        self.chance = random.Random(seed)
        self.first_retry = self.chance.choice(FIRST_RETRIES)
        self.end = self.chance.uniform(2.0, 12.0)
        self.outages = list(self._outages())
        self.deliveries = sorted(self._deliver(list(self._publish(rate))))  # (arrival, publication) [s]

    def up(self, begin, end):
        return not any(first < end and begin < last for first, last in self.outages)

    def _outages(self):
        now = 0.5
        while now < self.end:
            now += self.chance.choice((0.1, 0.3, 0.6, 1.5, 3.0)) * self.chance.uniform(0.0, 2.0)
            begin = now
            now += self.chance.choice((0.1, 0.25, 0.4, 0.6, 1.0, 1.5, 3.0)) * self.chance.uniform(0.7, 1.3)
            yield begin, now

    def _publish(self, rate):
        now, death = 0.1, self.chance.uniform(0.5, self.end)
        while now < death:
            pause = now + self.chance.choice((0.3, 1.0, 2.0)) * self.chance.uniform(0.0, 2.0)
            if self.chance.random() < 0.7:
                while now < min(pause, death):
                    yield now
                    now += 1.0 / rate
            now = max(now, pause)

    def _deliver(self, published):
        """What is lost is sent again after one, three, seven ... first pauses; what waits comes in growing pieces."""
        waiting, retry, pause = [], None, self.first_retry
        while published or waiting:
            if waiting and not (published and published[0] < retry):
                if self.up(retry, retry + TRIP):
                    arrival, amount = retry + TRIP, SEGMENT
                    while waiting:
                        yield from ((arrival, one) for one in waiting[:amount])
                        waiting, amount, arrival = waiting[amount:], 2 * amount, arrival + 2 * TRIP
                    pause = self.first_retry
                else:
                    pause *= 2
                    retry += pause
            else:
                now = published.pop(0)
                if not waiting and self.up(now, now + TRIP):
                    yield now + TRIP, now
                else:
                    retry = retry if waiting else now + self.first_retry
                    waiting.append(now)


def longest_drive(history):
    """[s] from a command's publication to the end of the motion that it causes, the longest of a history."""
    link, count, order = Link(0.0), 0, itertools.count()
    events = [(arrival, next(order), "message", published) for arrival, published in history.deliveries]
    looks, end = history.chance.random() * PERIOD, events[-1][0] if events else 0.0
    while looks < end:
        events.append((looks, next(order), "look", None))
        looks += PERIOD * history.chance.uniform(1.0, 1.05)
    heapq.heapify(events)
    seen, probing, longest = -1, False, 0.0
    published, until = 0.0, 0.0  # of the command that drives
    while events:
        now, _, event, data = heapq.heappop(events)
        if event == "message":
            count += 1
            age = link.age(now)
            if age < TIMEOUT:
                longest = max(longest, min(now, until) - published)
                published, until = data, now - age + TIMEOUT
        elif event == "look":
            if count == seen and not probing:
                probing = True
                answered = history.up(now, now + 2 * TRIP)
                heapq.heappush(events, (now + (2 * TRIP if answered else ANSWER_WITHIN), next(order),
                                        "answer" if answered else "no answer", now))
            seen = count
        elif event == "answer":
            probing = False
            link.reached(data)
        else:
            probing, link.lost = False, True
    return max(longest, until - published)


@pytest.mark.parametrize("rate", [5.0, 10.0, 20.0, 50.0])
def test_no_command_moves_the_robot_for_longer_than_the_time_out_after_it_was_sent(rate):
    for seed in range(2000):
        drive = longest_drive(History(seed, rate))
        assert drive < TIMEOUT + TRIP, f"seed {seed}"
