"""A sampled controller: an inverted pendulum on a cart is held upright by a program that reads its state every 20 ms.

The force is a parameter, constant between samples: the loop sets it, and the run reads it at every evaluation. The gains follow from the linearization of
the scene and SciPy's solution of the Riccati equation.
"""

import numpy as np

import hhtdae


def model():
    scene = hhtdae.Scene(gravity=(0, 0, -9.81))
    force = scene.parameter("force", 0.)
    cart = scene.rigid_body("cart", mass=1)
    rod = scene.rigid_body("rod", mass=0.1, inertia=hhtdae.inertia.box(0.1, (0.01, 0.01, 1)), position=(0, 0, 0.5))
    along_x = hhtdae.axes_along((1, 0, 0))
    track = cart.marker(axes=along_x)
    scene.add("track", hhtdae.Translational(track, scene.ground.marker(axes=along_x)))
    across = hhtdae.axes_along((0, 1, 0), x=(0, 0, 1))
    hinge, seat = rod.marker((0, 0, -0.5), axes=across), cart.marker(axes=across)
    scene.add("hinge", hhtdae.Revolute(hinge, seat))
    scene.add("motor", hhtdae.UserForce(track, force=[force, 0, 0]))
    state = [hhtdae.displacement(track, "x"), hhtdae.angle(hinge, seat), hhtdae.velocity(track, "x"), hhtdae.angular_velocity(hinge, "y")]
    scene.add("push", hhtdae.UserForce(track, force=[hhtdae.where(hhtdae.time() < 0.1, 5., 0.), 0, 0]))
    return scene, force, track, state


def gains(scene, track, state, dt):
    from scipy.linalg import expm, solve_discrete_are

    A, B, C, D = scene.run().linearize().state_space([hhtdae.Excitation.force(track, (1, 0, 0))], state)
    T = np.linalg.inv(C)  # from the scene's minimal coordinates to the four measures
    A, B = C @ A @ T, C @ B
    step = expm(dt * np.block([[A, B], [np.zeros((1, 5))]]))
    A, B = step[:4, :4], step[:4, 4:]
    P = solve_discrete_are(A, B, np.diag([1., 10., 0.1, 0.1]), np.eye(1))
    return np.linalg.solve(np.eye(1) + B.T @ P @ B, B.T @ P @ A)[0]


def main():
    scene, force, track, state = model()
    K = gains(scene, track, state, 0.02)
    print("gains:", np.array2string(K, precision=3))
    run, largest = scene.run(tolerance=1e-6), 0
    for t in run.step_by(0.02, until=10):
        now = run.snapshot()
        x = np.array([now.value(s) for s in state])
        force.set(-K @ x)
        largest = max(largest, abs(x[1]))
    print("largest angle %.4f rad; after 10 s the cart is at %.5f m, the rod at %.6f rad" % (largest, x[0], x[1]))
    return largest, x[0], x[1]


if __name__ == "__main__":
    main()
