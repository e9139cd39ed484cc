/*
  Small motions about a state of a run: natural modes, frequency response, and the equations in minimal coordinates.

    Linearization small;
    PetscCall(small.take(ts));                                what the run has reached; of one that has not begun, the start
    std::vector<Mode> modes;
    PetscCall(small.modes(&modes));                           all of them; of a large scene SlowestModes(), hhtdae/modes.h
    std::vector<std::complex<double>> h;
    PetscCall(small.response(Excitation::force(tip, {0, 0, 1}), Measure::displacement(tip, 2), frequencies, &h));

  The equations of motion F(t, u, u', u'') = 0 with their constraints, multipliers, variables and force states are expanded about the state,

    M x'' + C x' + K x = b f,

  where x has displacements and small rotations of bodies, and changes of all other unknowns. M, C and K are taken at the time of the state.
  They remain constant only if the state is an equilibrium, or a motion that is steady in the axes that x refers to. At the time of the state
  these axes are the space axes; from then on they rotate with

    the body passed to take()             a driven hub for its blades, the rotor for a shaft that is not round; the frequencies of modes in the
                                          axes of a round rotor differ from those in space by its speed
    flexible bodies                       if no body is passed and all bodies in modal coordinates rotate alike, since these are in body axes
                                          (for whole bodies pass the one that carries them)
    nothing                               otherwise, or if the ground is passed to take(): an axisymmetric rotor of rigid discs at constant
                                          speed is steady in space axes

  A notice reports flexible bodies that do not rotate alike. Loads and measures in space axes rotate with the axes of x.

  A swinging rod is not steady in any axes. In such a state modes() and stateSpace() describe the rates of small motions at this time,
  including the change of constraints along the motion: A is the derivative of (z', z'') by (z, z'), where z are coordinates along the
  directions that constraints leave free, orthonormal in the metric of the masses. For a single degree of freedom the result is that of
  motion along its path at any speed: the rod has value^2 = -m g l cos(angle)/J. The sparse methods, response() and SlowestModes(), take
  constraints as they are at this time; they are meant for equilibria and steady motions.
  M, C and K are derivatives of the whole F, with positions, velocities, accelerations, multipliers and states held at their present values.
  So K has, besides springs, the stiffness of loads and reactions by their directions, of velocities (centrifugal) and of accelerations; C has
  dampers and gyroscopic terms. Changes of M, C and K with time are not included, but for the rates of constraints above.
  Loads, reactions and deformations that stiffen elastic bodies are those at this time in all calls: such bodies need an equilibrium or a
  steady motion, to which a run with damping leads. steadiness() tells how far the state is from one.
  All calls are collective, with the same results on every rank. A linearization is valid as long as its TS exists.
*/
#ifndef HHTDAE_LINEARIZE_H
#define HHTDAE_LINEARIZE_H

#include "hhtdae/query.h"
#include <complex>
#include <string>
#include <petscmat.h>

namespace hhtdae
{

/* A motion proportional to exp(value t). A conjugate pair is represented by the mode with a positive imaginary part. */
struct Mode {
  std::complex<double>              value;  /* 1/s */
  std::vector<std::complex<double>> shape;  /* x, the unknowns of this rank; the largest displacement (m) or rotation (rad) over all ranks is 1 */

  double frequency() const { return std::abs(value) / (2 * M_PI); } /* undamped, Hz */
  double dampingRatio() const { return std::abs(value) > 0 ? -value.real() / std::abs(value) : 0; }
};

using Vector3c = Eigen::Matrix<std::complex<double>, 3, 1, Eigen::DontAlign>; /* the same alignment for all options of the compiler */

/* A body's part in a mode: motion of its centre of mass in space axes, and its share of the kinetic energy */
struct BodyPart {
  Vector3c displacement = Vector3c::Zero(), rotation = Vector3c::Zero();
  double   share = 0;
};

/* Meaning of a unit input: a force and a moment in space axes on the body of a marker, at its origin; or an amount added to the function of a
   motion (displacement, velocity or acceleration, as the motion prescribes), for a shaken base; or an acceleration of the ground, to which
   all coordinates are relative */
struct Excitation {
  Marker  at;
  Vector3 load = Vector3::Zero(), moment = Vector3::Zero();
  Element driven = {};
  Vector3 ground = Vector3::Zero();
  static Excitation force(Marker m, const Vector3 &f) { return {m, f, Vector3::Zero(), {}, Vector3::Zero()}; }
  static Excitation torque(Marker m, const Vector3 &f) { return {m, Vector3::Zero(), f, {}, Vector3::Zero()}; }
  static Excitation motion(Element e) { return {{}, Vector3::Zero(), Vector3::Zero(), e, Vector3::Zero()}; }
  static Excitation groundAcceleration(const Vector3 &a) { return {{}, Vector3::Zero(), Vector3::Zero(), {}, a}; }
};

/* z' = A z + B f, y = C z + D f; the size of z is the number of degrees of freedom of positions, plus that of velocities, plus the number of
   first-order states. Matrices are stored row by row. */
struct StateSpace {
  PetscInt            states = 0, inputs = 0, outputs = 0;
  std::vector<double> A, B, C, D;
};

/* How far the state of a linearization is from one that is steady as seen from its axes. Changes are accelerations relative to the size of the scene, 1/s^2: what moves by itself with a
   rate x goes on with its mode where they are small beside x^2. */
struct Steadiness {
  std::string body, elastic; /* that changes its velocities most; the same among elastic bodies, modal or whole */
  double      change = 0, elastic_change = 0;
  double      square_rate = 0; /* of the motion of the scene, or of its fall: 1/s^2 */
  double      rounding    = 0; /* squares of rates of small motions up to here may be zero: what rounding leaves of the forces of the stiffest spring, 1/s^2 */
  double      spin        = 0; /* of the body that turns fastest, seen from space */
  std::string turning;         /* the body with modes that turns fastest relative to the axes, in which its modes are wrong: modal coordinates are in axes of the body; empty: none */
};

class Linearization
{
public:
  Linearization();
  ~Linearization();
  Linearization(const Linearization &)            = delete;
  Linearization &operator=(const Linearization &) = delete;

  /* The state of a run of Scene::createTS(), at time t between the ends of its last step (TSHHT3EvaluateAt()); before the first one the start. The
     run does not notice. axes: of x, see above */
  PetscErrorCode take(TS ts, PetscReal t, Body axes = {});
  PetscErrorCode take(TS ts, Body axes = {}); /* at the end of the last step */

  /* All modes, by increasing |value|: dense algebra, for scenes of up to 1000 unknowns. A motion that nothing drives back has value 0. */
  PetscErrorCode modes(std::vector<Mode> *all) const;
  /* The body's displacement, rotation and share of the kinetic energy */
  PetscErrorCode part(const Mode &m, Body b, BodyPart *part) const;
  /* What a measure does in the mode, with the scale of the mode's shape */
  PetscErrorCode value(const Mode &m, const Measure &what, std::complex<double> *x) const;

  /* The measure's complex amplitude where the input is cos(w t), for circular frequencies w in rad/s: Re(amplitude exp(i w t)). Sparse, one
     factorization of twice the unknowns for each of them; solver options have the prefix -scene_response_ */
  PetscErrorCode response(const Excitation &in, const Measure &out, const std::vector<double> &circular, std::vector<std::complex<double>> *amplitude) const;
  /* Minimal coordinates: dense algebra as that of modes(). Of motions as inputs it takes those of accelerations: others would enter with
     their derivatives. */
  PetscErrorCode stateSpace(const std::vector<Excitation> &in, const std::vector<Measure> &out, StateSpace *s) const;

  PetscErrorCode steadiness(Steadiness *s) const;

  /* M, C, K above in MATAIJ, one row and column for each unknown of the scene; they belong to this object */
  PetscErrorCode operators(Mat *M, Mat *C, Mat *K) const;

  /* A period of the mode for ParaView: prefix.pvd and a file for each frame, the shape times `amplitude` (m or rad at its largest); bodies as
     -scene_animation draws them. Times run from 0 to 1, also of a mode that does not oscillate, which goes to and fro. */
  PetscErrorCode animate(const Mode &m, const std::string &prefix, double amplitude, int frames = 24) const;
  /* Scales the mode to its largest displacement or rotation */
  PetscErrorCode normalize(Mode *m) const;

  struct Work;

private:
  std::unique_ptr<Work> work_;
};

} // namespace hhtdae

#endif
