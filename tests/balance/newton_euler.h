/*
  The laws of Newton and Euler, body by body, from a scene's channels: positions, velocities and accelerations of the
  bodies, reactions of joints and motions, components of forces,

    m a = sum of forces + m g,    J alpha + w x J w = sum of moments about the centre of mass,

  mass and inertia as described. With them comes the balance of power: the kinetic energy that the scene reports has to
  be that of the bodies as they move, whose rate the loads are by these laws. It shares with the scene the description
  and the channels, nothing of the residual: a load that does not act as it is reported, or acts on one body alone,
  leaves a body out of balance.

    NewtonEuler laws(scene, specs);            after everything has been described, before the scene is set up: adds
  channels scene.sample(ts, t, values); laws.judge(values).largest                 0: in balance; 1: what is missing is
  as large as all forces together

  Not judged: flexible bodies, whose inertia no channel shows (the frames of their attachments are, for forces: the
  multipliers of an attachment's first three rows are the force on its frame with the opposite sign), and bodies on
  which an element acts that ElementLoads does not know.
*/
#ifndef HHTDAE_TESTS_BALANCE_NEWTON_EULER_H
#define HHTDAE_TESTS_BALANCE_NEWTON_EULER_H

#include "balance/element_loads.h"

namespace hhtest
{

/* Of one body: what is left of the sum of forces, and all of them in absolute values; the same of moments */
struct BodyBalance {
  PetscInt body;
  Vector3  force = Vector3::Zero(), moment = Vector3::Zero();
  double   forces = 0, moments = 0, mass = 0, inertia = 0;
};

/* What an integrator has left of the equations of motion of a body, m r'' - f and J w' + w x J w - m, by the residual that
   it has solved, and how much it may leave */
struct BodyResidual {
  Vector3 force = Vector3::Zero(), moment = Vector3::Zero();
  double  force_allowed = 0, moment_allowed = 0;
  double  force_rounding = 0, moment_rounding = 0; /* of loads evaluated twice */
};

struct Imbalance {
  double      largest = 0; /* of |what is left| over the sum of absolute values, of forces and moments of all bodies */
  std::string where;       /* "moment on arm" */
};

/* Powers at one time, of the loads by which elements act on bodies and of gravity */
struct Powers {
  double joints = 0, motions = 0, forces = 0, gravity = 0; /* joints: zero, as no joint moves by itself */
  double of_joints = 0,
         absolute  = 0; /* the same with every load along its velocity: what the sums above are measured against */
  double all() const { return joints + motions + forces + gravity; } /* the rate of kinetic energy */
};

class NewtonEuler
{
public:
  NewtonEuler(hhtdae::Scene &scene, const Specs &specs);

  std::vector<BodyBalance> bodies(const std::vector<double> &values) const;
  /* what is missing beyond the residuals `left`; none: nothing is left */
  Imbalance judge(const std::vector<double> &values, const std::vector<BodyResidual> &left = {}) const;
  /* by what the residuals exceed what they may be */
  Imbalance unsolved(const std::vector<double> &values, const std::vector<BodyResidual> &left) const;
  Powers    powers(const std::vector<double> &values) const;
  std::vector<double>
  magnitudes(const std::vector<double> &values) const; /* of the loads of each element: their largest force or moment */
  double kinetic(const std::vector<double> &values) const; /* energy of the rigid bodies and points */
  int    judged() const;                                   /* bodies */
  const std::vector<std::string> &unknown() const
  {
    return unknown_;
  } /* types of elements whose loads cannot be told */

private:
  struct OfBody {
    int  position = -1, velocity = -1, acceleration = -1; /* first of three channels */
    int  axis[2] = {-1, -1}, spin = -1, turning = -1;
    bool judged = true, moments = true;
  };
  struct OfElement {
    bool known = false;
    int  force = -1, moment = -1, component = -1, components = 0;
  };
  hhtdae::Scene           &scene_;
  const Specs              specs_;
  Marker                   origin_;
  std::vector<OfBody>      body_;
  std::vector<OfElement>   element_;
  int                      kinetic_ = -1; /* channel; -1: the scene has flexible bodies */
  std::vector<std::string> unknown_;

  template <class Make> int three(const Make &make);
  template <class Amounts> Imbalance largest(const std::vector<BodyBalance> &all, const Amounts &amounts) const;
  BodyResidual              residualOf(PetscInt body, const std::vector<BodyResidual> &left) const;
  void                      look(PetscInt body);
  void                      lookAt(PetscInt element);
  void                      leaveOut(PetscInt element);
  Vector3                   read(const std::vector<double> &values, int first) const;

  std::vector<Pose>              poses(const std::vector<double> &values) const;
  std::vector<std::vector<Load>> loads(const std::vector<double> &values,
                                       const std::vector<Pose>   &pose) const; /* by element */
};

} // namespace hhtest

#endif
