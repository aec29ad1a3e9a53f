"""A coordinated-turn aircraft in wind with a camera on a gimbal, for guidance tests: closed forms and noise,
and no line of the code under test but its message values.
"""

import math
from collections import deque

import numpy as np

from estimators.tracking.line_of_sight import Detection, GimbalAttitude
from flightsim.foundation.vectors import from_euler, product
from tests.rotations import rotation_matrix

STEP_US = 20_000
G = 9.80665


class PointMass:
    """Aircraft, wind, target and sensors. `step(roll_command)` advances 20 ms and gives what is measured."""

    def __init__(
        self,
        *,
        seed=0,
        position=(0.0, 0.0),
        heading=0.0,
        height=100.0,
        airspeed=25.0,
        wind=(4.0, 0.0),
        target=(0.0, 0.0),
        target_velocity=(0.0, 0.0),
        roll_error=0.0,
        airspeed_scale=0.0,
        gust=0.7,
        detection=0.96,
        latency_us=100_000,
        angle_noise=0.002,
        clutter=0.0,
    ):
        self.rng = np.random.default_rng(seed)
        self.p = np.array(position, dtype=float)
        self.psi, self.phi, self.h, self.v = heading, 0.0, height, airspeed
        self.wind, self.gusts, self.gust = np.array(wind, dtype=float), np.zeros(2), gust
        self.target, self.target_velocity = (
            np.array(target, dtype=float),
            np.array(target_velocity, dtype=float),
        )
        self.roll_error, self.airspeed_scale = roll_error, airspeed_scale
        self.detection, self.latency_us, self.noise = detection, latency_us, angle_noise
        self.clutter = clutter
        self.time_us = 0
        self.az = self.el = 0.0
        self.pointed = (0.0, 0.0)
        self.late = deque()
        self.blind = False

    @property
    def radius(self):
        return float(np.hypot(*(self.target - self.p)))

    def step(self, roll_command):
        dt = STEP_US * 1e-6
        self.time_us += STEP_US
        rate = np.clip((roll_command - self.phi) / 0.35, -1.2, 1.2)
        self.phi += rate * dt
        self.psi += G * math.tan(self.phi) / self.v * dt
        decay = math.exp(-dt / 4.0)
        self.gusts = decay * self.gusts + self.gust * math.sqrt(1 - decay**2) * self.rng.standard_normal(2)
        air = self.v * np.array((math.cos(self.psi), math.sin(self.psi)))
        self.p = self.p + dt * (air + self.wind + self.gusts)
        self.target = self.target + dt * self.target_velocity
        for k, name in enumerate(("az", "el")):
            turn = math.remainder(self.pointed[k] - getattr(self, name), math.tau)
            setattr(self, name, getattr(self, name) + float(np.clip(turn, -2.1 * dt, 2.1 * dt)))
        q_body = from_euler(self.phi, 0.03, self.psi)
        q_gimbal = product(q_body, from_euler(0.0, self.el, self.az))  # in NED
        level = product(from_euler(0.0, 0.0, -self.psi), q_gimbal)
        tilted = product(from_euler(self.roll_error, 0.0, 0.0), level)
        attitude = (self.time_us, self.phi, 0.03, math.remainder(self.psi, math.tau))
        gimbal = GimbalAttitude(time_us=self.time_us, q=tuple(tilted), from_north=False)
        if self.time_us % 100_000 == 0:
            self._expose(q_gimbal)
        found = []
        while self.late and self.late[0][0] + self.latency_us <= self.time_us:
            found.append(self.late.popleft()[1])
        airspeed = self.v * (1.0 + self.airspeed_scale) + 0.3 * self.rng.standard_normal()
        height = self.h + 0.3 * self.rng.standard_normal()
        return attitude, gimbal, airspeed, height, found

    def _expose(self, q_gimbal):
        for _ in range(self.rng.poisson(self.clutter)):
            x, y = self.rng.uniform(-0.57, 0.57), self.rng.uniform(-0.32, 0.32)
            self.late.append((self.time_us, Detection(time_us=self.time_us, target=0, image_x=x, image_y=y)))
        d = np.array((*(self.target - self.p), self.h))
        forward, right, down = rotation_matrix(q_gimbal).T @ d
        if forward <= 0 or self.blind or self.rng.random() > self.detection:
            return
        u, v = right / forward, down / forward
        if abs(u) < 0.57 and abs(v) < 0.32:
            u, v = np.array((u, v)) + self.noise * self.rng.standard_normal(2)
            found = Detection(time_us=self.time_us, target=0, image_x=float(u), image_y=float(v))
            self.late.append((self.time_us, found))
