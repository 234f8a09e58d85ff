# SPDX-License-Identifier: BSD-3-Clause
"""Cubes, the glove and the containers in the pictures of the cell camera (6.2.3.2, 6.2.3.3).

    tracking = Tracking(camera, workspace, palette)
    tracking.start_task()
    seen = tracking.step(t, bgr, depth)      # hand, cubes, deposits; frame cell
    deposits = tracking.on_load_step(tray, t)

Pictures go through five stages: segmentation by colour (`segmentation`), border-following contours
(`contours`), depth and position (`measuring`), one Kalman filter a track with assignment
(`kalman`, `tracker`, `hand`), containers (`containers`).
"""
