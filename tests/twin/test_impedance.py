"""The impedance law by hand: spring, damper, bounds, and the rate at which torques may change."""

import numpy as np
import pytest

from hcpg.twin.impedance import TORQUE_LIMIT, Gains, Impedance, Readings, turn

# Each of the first six joints moves one direction, the seventh none: torques are forces.
JACOBIAN = np.hstack([np.eye(6), np.zeros((6, 1))])
GAINS = Gains(translation_n_m=1000.0, rotation_nm_rad=100.0, lead_m=0.01, turn_rad=0.05, posture_nm_rad=4.0)


def readings(position=(0, 0, 0), rotation=None, angles=(0,) * 7, speeds=(0,) * 7, coriolis=(0,) * 7):
    rotation = np.eye(3) if rotation is None else rotation
    parts = (np.array(each, float) for each in (angles, speeds, coriolis))
    return Readings(np.array(position, float), rotation, JACOBIAN, *parts)


def torques(state, target=(0, 0, 0), elapsed_s=1.0):
    return Impedance(GAINS, np.eye(3), np.zeros(7)).torques(state, np.array(target, float), elapsed_s)


def about_z(angle):
    return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1.0]])


def test_a_spring_pulls_and_a_damper_brakes():
    pulled = torques(readings(), target=(0.005, 0, 0))
    np.testing.assert_allclose(pulled, [5.0, 0, 0, 0, 0, 0, 0], atol=1e-12)
    braked = torques(readings(speeds=(0.1, 0, 0, 0, 0, 0, 0)))
    assert braked[0] == pytest.approx(-2 * np.sqrt(1000.0) * 0.1)


def test_the_error_is_bounded_along_each_axis():
    far = torques(readings(), target=(0.5, -0.5, 0.002))
    np.testing.assert_allclose(far[:3], [10.0, -10.0, 2.0])


def test_a_turned_hand_is_turned_back():
    np.testing.assert_allclose(turn(about_z(0.01), np.eye(3)), [0, 0, -np.sin(0.01)], atol=1e-12)
    back = torques(readings(rotation=about_z(0.01)))
    assert back[5] == pytest.approx(-100 * np.sin(0.01))
    assert torques(readings(rotation=about_z(0.5)))[5] == pytest.approx(-5.0)


def test_the_posture_acts_only_where_it_does_not_move_the_hand():
    posed = torques(readings(angles=(0.1, 0, 0, 0, 0, 0, 0.1)))
    np.testing.assert_allclose(posed, [0, 0, 0, 0, 0, 0, -0.4], atol=1e-12)


def test_torques_change_by_one_newton_metre_a_millisecond_and_stay_within_the_joints():
    law = Impedance(Gains(translation_n_m=1e5, lead_m=1.0, turn_rad=1.0), np.eye(3), np.zeros(7))
    grown = [law.torques(readings(), np.array([1.0, 0, 0]), 0.002)[0] for _ in range(50)]
    np.testing.assert_allclose(grown[:3], [2.0, 4.0, 6.0])
    assert grown[-1] == TORQUE_LIMIT[0] == 87.0
    law.relax()
    assert law.torques(readings(), np.array([1.0, 0, 0]), 0.002)[0] == pytest.approx(2.0)


def test_coriolis_torques_are_given_back():
    assert torques(readings(coriolis=(0.3, 0, 0, 0, 0, 0, 0.2))).tolist() == [0.3, 0, 0, 0, 0, 0, 0.2]
