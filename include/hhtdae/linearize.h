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

  x: displacements and small rotations of bodies, and all other unknowns as they are. M, C and K are those of this moment: small motions go on with
  them where the state is in equilibrium, or steady as seen from the axes that x is in. These are at this moment those of space, and from then on they turn with

    the body that take() is given         a driven hub for its blades, the rotor for a shaft that is not round; modes in axes of a round rotor are
                                          those in space, faster or slower by its speed
    flexible bodies                       without one, where all of them turn alike: modal coordinates are in axes of the body
    nothing                               else, and where take() is given the ground: an axisymmetric rotor of rigid discs at speed is steady as
                                          seen from space

  Of flexible bodies that do not turn alike a notice says so. Loads and measures of space axes turn with the axes.

  A swinging rod is steady from nowhere. There modes() and stateSpace() are of the rates that small motions have at this moment, how constraints change
  along the motion included: A is the derivative of (z', z'') by (z, z'), where z are lengths along what constraints leave, in units of masses. Of a single freedom
  they are those of its path whatever the speed: the rod has value^2 = -m g l cos(angle)/J. What is sparse, response() and SlowestModes(), takes constraints as they
  are at this moment: it is of equilibria and steady motions.
  All calls are collective, with the same results on every rank. A linearization is of use as long as its TS is.
*/
#ifndef HHTDAE_LINEARIZE_H
#define HHTDAE_LINEARIZE_H

#include "hhtdae/query.h"
#include <complex>
#include <petscmat.h>

namespace hhtdae
{

/* Motion that goes as exp(value t). Of a conjugate pair the one with a positive imaginary part stands for both. */
struct Mode {
  std::complex<double>              value;  /* 1/s */
  std::vector<std::complex<double>> shape;  /* x, the unknowns of this rank; the largest displacement (in m) or rotation (in rad) of all is 1 */

  double frequency() const { return std::abs(value) / (2 * M_PI); } /* undamped, Hz */
  double dampingRatio() const { return std::abs(value) > 0 ? -value.real() / std::abs(value) : 0; }
};

using Vector3c = Eigen::Matrix<std::complex<double>, 3, 1, Eigen::DontAlign>; /* the same for all compiler's options */

/* A body's part in a mode: of its centre of mass in space axes, and how much of the kinetic energy it has */
struct BodyPart {
  Vector3c displacement = Vector3c::Zero(), rotation = Vector3c::Zero();
  double   share = 0;
};

/* What an input of 1 is: a force and a moment in space axes on the body of a marker, at its origin; or what is added to the function of a
   motion, displacement, velocity or acceleration as the motion is of: a shaken base; or the acceleration of the ground, relative to which all
   coordinates are */
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

/* z' = A z + B f, y = C z + D f; z: as many as there are degrees of freedom of positions and of velocities, and first-order states. Rows
   are behind one another. */
struct StateSpace {
  PetscInt            states = 0, inputs = 0, outputs = 0;
  std::vector<double> A, B, C, D;
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
