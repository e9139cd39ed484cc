/*
  The laws of Newton and Euler, body by body, from a scene's channels: positions, velocities and accelerations of the
  bodies, reactions of joints and motions, components of forces,

    m a = sum of forces + m g,    J alpha + w x J w = sum of moments about the centre of mass,

  with mass and inertia as described. In addition the balance of power is checked: the kinetic energy that the scene
  reports must be that of the moving bodies, and its rate must be the power of all loads. Only the description and the
  channels are shared with the scene, not the residual: if a load acts differently from what is reported, or on one body
  only, a body is out of balance.

    NewtonEuler laws(scene, specs);            after everything has been described, before the scene is set up: adds
  channels scene.sample(ts, t, values); laws.judge(values).largest                 0: in balance; 1: what is missing is
  as large as all forces together

  Not judged are bodies on which an element acts that ElementLoads does not know, and flexible bodies, whose inertia no
  channel shows. The forces on the frames of their attachments are judged: the multipliers of an attachment's first three
  rows are the force on its frame with the opposite sign.
*/
#ifndef HHTDAE_TESTS_BALANCE_NEWTON_EULER_H
#define HHTDAE_TESTS_BALANCE_NEWTON_EULER_H

#include "balance/element_loads.h"

namespace hhtest
{

/* For one body: remaining sum of forces, and sum of their absolute values; the same for moments */
struct BodyBalance {
  PetscInt body;
  Vector3  force = Vector3::Zero(), moment = Vector3::Zero();
  double   forces = 0, moments = 0, mass = 0, inertia = 0;
};

/* What an integrator has left of the equations of motion of a body, m r'' - f and J w' + w x J w - m, according to the
   residual that it has solved, and how much it may leave */
struct BodyResidual {
  Vector3 force = Vector3::Zero(), moment = Vector3::Zero();
  double  force_allowed = 0, moment_allowed = 0;
  double  force_rounding = 0, moment_rounding = 0; /* rounding of loads that are evaluated twice */
};

struct Imbalance {
  double      largest = 0; /* largest ratio, over forces and moments of all bodies, of the remaining amount to the sum of absolute values */
  std::string where;       /* for example "moment on arm" */
};

/* Powers at one time of the loads of elements on bodies, and of gravity */
struct Powers {
  double joints = 0, motions = 0, forces = 0, gravity = 0; /* joints: zero, because constraints that do not depend on time do no work */
  double of_joints = 0,
         absolute  = 0; /* the same with all powers taken as positive, as the scale of the sums above */
  double all() const { return joints + motions + forces + gravity; } /* the rate of kinetic energy */
};

class NewtonEuler
{
public:
  NewtonEuler(hhtdae::Scene &scene, const Specs &specs);

  std::vector<BodyBalance> bodies(const std::vector<double> &values) const;
  /* the imbalance beyond the residuals `left`; without these, the whole imbalance */
  Imbalance judge(const std::vector<double> &values, const std::vector<BodyResidual> &left = {}) const;
  /* the amount by which residuals exceed what they may be */
  Imbalance unsolved(const std::vector<double> &values, const std::vector<BodyResidual> &left) const;
  Powers    powers(const std::vector<double> &values) const;
  std::vector<double>
  magnitudes(const std::vector<double> &values) const; /* largest force or moment of each element */
  double kinetic(const std::vector<double> &values) const; /* kinetic energy of the rigid bodies and points */
  int    judged() const;                                   /* number of bodies judged */
  const std::vector<std::string> &unknown() const
  {
    return unknown_;
  } /* types of elements whose loads are not known */

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
  int                      kinetic_ = -1; /* channel; -1 if the scene has flexible bodies */
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
