"""Pictures of AprilTags as a camera would take them: anti-aliased, blurred, noisy."""

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

FOCAL, WIDTH, HEIGHT, SIZE_M = 610.0, 640, 480, 0.04
MATRIX = np.array([[FOCAL, 0, 320.0], [0, FOCAL, 240.0], [0, 0, 1]])
CELLS, PIXELS_PER_CELL, FINE = 10, 20, 4  # 8 cells of the tag with its black edge, and one white one around
FAMILY = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
FACING = Rotation.from_euler("x", 180, degrees=True)  # the tag's z points back at the camera, its y up


def texture(number):
    inside = cv2.aruco.generateImageMarker(FAMILY, number, 8 * PIXELS_PER_CELL)
    return cv2.copyMakeBorder(inside, *[PIXELS_PER_CELL] * 4, cv2.BORDER_CONSTANT, value=255)


def picture(tags, seed=0, size=(WIDTH, HEIGHT)):
    """Of tags {number: (position, Rotation)} in the camera's frame, 40 mm each; grey background."""
    width, height = size
    fine = np.full((height * FINE, width * FINE), 120, np.uint8)
    for number, (position, rotation) in tags.items():
        half = SIZE_M * CELLS / 8 / 2
        corners = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
        seen = rotation.apply(corners) + position
        pixels = FOCAL * seen[:, :2] / seen[:, 2:] + [320.0, 240.0]
        edge = CELLS * PIXELS_PER_CELL - 0.5
        source = np.array([[-0.5, -0.5], [edge, -0.5], [edge, edge], [-0.5, edge]], np.float32)
        target = ((pixels + 0.5) * FINE - 0.5).astype(np.float32)
        warp = cv2.getPerspectiveTransform(source, target)
        drawn = cv2.warpPerspective(texture(number), warp, fine.shape[::-1], flags=cv2.INTER_LINEAR)
        mask = cv2.warpPerspective(np.full_like(texture(number), 255), warp, fine.shape[::-1])
        fine = np.where(mask > 127, drawn, fine)
    image = cv2.GaussianBlur(cv2.resize(fine, size, interpolation=cv2.INTER_AREA), (0, 0), 0.8)
    noise = np.random.default_rng(seed).normal(0, 3, image.shape)
    return np.clip(image + noise, 0, 255).astype(np.uint8)


def poses(count, seed=0):
    """Positions 0.45 to 0.75 m ahead, turned by up to 40 degrees."""
    random = np.random.default_rng(seed)
    for _ in range(count):
        position = random.uniform([-0.12, -0.08, 0.45], [0.12, 0.08, 0.75])
        tilt = Rotation.from_euler("zxy", random.uniform(-40, 40, 3), degrees=True)
        yield position, FACING * tilt
