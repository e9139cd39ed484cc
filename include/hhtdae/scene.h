/*
  Multibody scenes: rigid bodies, markers, joints, motions and forces, assembled in parallel for a PETSc time stepper.

    hhtdae::Scene scene(PETSC_COMM_WORLD);
    Body   arm   = scene.add("arm", RigidBody{mass, inertia, position});
    Marker pivot = scene.marker(arm, {-1, 0, 0});
    scene.add("pin", Revolute{pivot, scene.marker(scene.ground(), {0, 0, 0})});
    TS ts;
    PetscCall(scene.createTS(&ts));
    PetscCall(TSSetFromOptions(ts));
    PetscCall(scene.solve(ts));

  Units are the user's own, but consistent; angles are in radians. Building a scene never fails: what is wrong with it is reported
  by name, all of it at once, as a PETSc error from setUp(), createTS() or solve(), whichever comes first. Every rank describes the
  same scene in the same order; METIS gives each rank its part of the bodies.
*/
#ifndef HHTDAE_SCENE_H
#define HHTDAE_SCENE_H

#include "hhtdae/forces.h"
#include "hhtdae/functions.h"
#include "hhtdae/hhtdae.h"
#include "hhtdae/joints.h"
#include "hhtdae/modal.h"
#include "hhtdae/output.h"
#include "hhtdae/types.h"
#include <memory>
#include <string>
#include <vector>

namespace hhtdae
{

enum class Space {
  Spatial, /* rigid bodies have 6 coordinates: position of the centre of mass, 3-1-3 Euler angles */
  Planar   /* 3: position of the centre of mass in the xy plane, angle about z; markers lie in that plane, their z axes along z */
};

struct RigidBody {
  double  mass    = 1;
  Matrix3 inertia = Matrix3::Identity();  /* about the centre of mass, in body axes; planar: element (2,2) alone counts */
  Vector3 position = Vector3::Zero();     /* of the body's origin at the start, space axes */
  Matrix3 rotation = Matrix3::Identity(); /* body axes as columns, at the start */
  Vector3 velocity = Vector3::Zero();     /* of the centre of mass, space axes */
  Vector3 angular_velocity = Vector3::Zero(); /* space axes */
  Vector3 center = Vector3::Zero();       /* of mass, in body axes from the body's origin */
  bool    fixed_start = false;            /* the assembly phase leaves pose and velocities as given */
};

struct PointMass { /* 3 coordinates, no rotation; planar 2 */
  double  mass     = 1;
  Vector3 position = Vector3::Zero();
  Vector3 velocity = Vector3::Zero();
  bool    fixed_start = false;
};

struct DampingBand { /* modes up to this frequency, in cycles per unit of time */
  double below, ratio;
};

/*
  A flexible body: 6 + modes coordinates, those of its floating frame, whose origin is the undeformed centre of mass, and of the
  modes of its model. Joints, forces and markers take hold of its attachments, Scene::attachment().
*/
struct FlexibleBody {
  std::shared_ptr<const ModalBody> model;
  Vector3   position         = Vector3::Zero();     /* of the origin of the FE model at the start, space axes */
  Matrix3   rotation         = Matrix3::Identity(); /* axes of the FE model as columns, at the start */
  Vector3   velocity         = Vector3::Zero();     /* of the undeformed centre of mass, space axes */
  Vector3   angular_velocity = Vector3::Zero();     /* space axes */
  ModalMass mass             = ModalMass::Full;
  std::vector<DampingBand> damping;  /* ratio of critical, by bands of increasing frequency; beyond the last one its ratio; empty: none */
  Eigen::VectorXd          ratios;   /* the same, mode by mode; it goes before the bands */
  Eigen::VectorXd deformation, deformation_rate; /* modal coordinates at the start; empty: undeformed */
  bool            fixed_start = false;
};

/* What is done about initial values that violate the constraints, and about constraints that say the same thing twice */
enum class Assembly {
  Off,
  Report, /* a misfit beyond the tolerance is an error that names the elements */
  Project /* bodies and velocities move to the nearest consistent ones in the metric of the masses; fixed_start holds a body */
};
enum class Redundant {
  Drop,   /* redundant rows at the start are left out of the run, with a notice */
  Refuse, /* are an error */
  Keep    /* are not looked for */
};
struct StartPolicy {
  Assembly  assembly    = Assembly::Report;  /* -scene_assemble off,report,project */
  double    tolerance   = 1e-6;              /* -scene_assemble_tol: of misfits, times the scene's size for lengths; radians */
  Redundant redundant   = Redundant::Drop;   /* -scene_redundant drop,refuse,keep */
  bool      equilibrium = false;             /* -scene_equilibrium: the run starts at rest in static equilibrium */
  bool      view        = false;             /* -scene_view: prints what the start has done */
  double    time        = 0;                 /* -scene_start_time: of the initial values */
};

struct SceneData; /* src/scene/scene_data.h */

class Scene
{
public:
  explicit Scene(MPI_Comm comm, Space space = Space::Spatial);
  ~Scene();
  Scene(const Scene &)            = delete;
  Scene &operator=(const Scene &) = delete;

  /* bodies; an empty name becomes "body 7" */
  Body ground() const { return Body{-1, number_}; }
  Body add(const std::string &name, const RigidBody &body);
  Body add(const std::string &name, const PointMass &body);
  Body add(const std::string &name, const FlexibleBody &body);

  /* The frame that follows an attachment of a flexible body, its origin at the attachment's point, its axes those of the FE model
     as long as there is no deformation: a body for markers and shapes. It costs 12 unknowns where it is asked for, nothing else. */
  Body attachment(Body flexible, const std::string &name);

  /* a marker on a body: position and axes (columns) in body axes from the body's origin; of the ground: in space axes */
  Marker marker(Body body, const Vector3 &position = Vector3::Zero(), const Matrix3 &axes = Matrix3::Identity(),
                const std::string &name = "");
  /* the same, given where it is at the start, in space axes */
  Marker markerAt(Body body, const Vector3 &position, const Matrix3 &axes = Matrix3::Identity(), const std::string &name = "");

  /* joints, motions, forces: joints.h, forces.h */
  template <class Spec> Element add(const std::string &name, const Spec &spec);

  /* user-defined variable V = expression; first-order state x' = rate; see functions.h */
  Variable variable(const std::string &name, const Expression &definition, double initial = 0);
  State    state(const std::string &name, const Expression &rate, double initial);

  void gravity(const Vector3 &acceleration);

  /* results, output.h: a channel to sample; what a body looks like, the ground too; a line through markers, a spring for example */
  Channel         channel(const std::string &name, const Measure &measure, const std::string &unit = "");
  void            shape(Body body, const Shape &shape);
  void            line(const std::vector<Marker> &markers);
  OutputSettings &output();

  /* How the run starts; options come after it */
  StartPolicy &start();

  /* Checks the scene, assembles it, drops redundant constraints, numbers and distributes it, looks for static equilibrium, all as
     start() says; collective; called by createTS() when it has not been. After this the scene is fixed: what is added later is an
     error of the next createTS(), solve() or sample(). */
  PetscErrorCode setUp();

  /* A TS of type TSHHT3 with the scene's residual, Jacobian, roles and initial state; the caller destroys it, the scene must
     outlive it. Set final time, step and options on it as on any TS. Each run from the start takes a TS of its own: the scene holds
     axes of Euler angles and unwound angles of the run at hand, which begins anew with each TS and ends those before. */
  PetscErrorCode createTS(TS *ts);

  /* TSSolve(), output. */
  PetscErrorCode solve(TS ts);

  /* Values of all channels, in their order, on every rank: at time t between the ends of the last step, after scene.solve() or in a
     monitor. Collective. */
  PetscErrorCode sample(TS ts, PetscReal t, std::vector<double> &values);

  PetscErrorCode view(PetscViewer viewer) const;

  /* Everything, for the library's own rooms and for tests */
  SceneData       &data() { return *data_; }
  const SceneData &data() const { return *data_; }

private:
  PetscInt                   number_; /* of this scene, in the handles that it gives */
  std::unique_ptr<SceneData> data_;
  Body addFrame(Body flexible, PetscInt attachment);
};

} // namespace hhtdae

#endif
