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
  by name, all of it at once, as a PETSc error from setUp(), createTS() or solve(), whichever comes first. Exceptions of the user's own
  functions that are tried as they are added, laws of springs and motions in time, come from add(). Every rank describes the
  same scene in the same order; METIS gives each rank its part of the bodies.

  Names are what messages and results call things by: bodies, elements (joints, motions and forces together), variables, states and channels must not have
  the same name as another one of their kind, which is an error. An empty name becomes the kind's, of an element its type's, with the number among all of
  the kind from 0 on: "body 7", "revolute 3", "spring-damper 4", "variable 0", "state 0", "channel 2". A motion of accelerations called "drive" makes
  a state "drive speed". Names of markers are for messages alone and may repeat.

  Options of the start, StartPolicy, and of the linear solvers of start and analyses, analyses.h, have no prefix of a TS. Those of results, output.h,
  have the prefix of the run's TS, as its -ts_ options do: after TSSetOptionsPrefix(ts, "a_") -scene_csv is -a_scene_csv.
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
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <vector>

namespace hhtdae
{

enum class Space {
  Spatial, /* rigid bodies have 6 coordinates: position of the centre of mass, rotation, see Rotations */
  Planar   /* 3: position of the centre of mass in the xy plane, angle about z; markers lie in that plane, their z axes along z */
};

struct RigidBody { /* without mass, or moments of inertia, where joints and motions determine what would have none */
  double  mass    = 1;
  Matrix3 inertia = Matrix3::Identity();  /* about the centre of mass, in body axes; planar: element (2,2) alone counts */
  Vector3 position = Vector3::Zero();     /* of the body's origin at the start, space axes */
  Matrix3 rotation = Matrix3::Identity(); /* body axes as columns, at the start */
  Vector3 velocity = Vector3::Zero();     /* of the centre of mass, space axes */
  Vector3 angular_velocity = Vector3::Zero(); /* space axes */
  Vector3 center = Vector3::Zero();       /* of mass, in body axes from the body's origin */
  bool    fixed_start = false;            /* the assembly phase leaves pose and velocities as given */
};

struct PointMass { /* 3 coordinates, planar 2; no rotation: what would act on it with a moment is refused */
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
  modes of its model. Joints, forces and markers take hold of its attachments and kept nodes, Scene::attachment() and node(); loads
  that are spread over it are ModalLoad and gravity.
*/
struct FlexibleBody {
  std::shared_ptr<const ModalBody> model;
  Vector3   position         = Vector3::Zero();     /* of the origin of the FE model at the start, space axes */
  Matrix3   rotation         = Matrix3::Identity(); /* axes of the FE model as columns, at the start */
  Vector3   velocity         = Vector3::Zero();     /* of the undeformed centre of mass, space axes */
  Vector3   angular_velocity = Vector3::Zero();     /* space axes */
  ModalMass mass             = ModalMass::Full;
  /* Ratio of critical, by bands of increasing frequency; beyond the last one its ratio; empty: none. Ratios and frequencies are those of the model's modes, of the
     free body: modes of the body as it is held in the scene are slower, and damped less (the first of a cantilever by a fourteenth of the ratio). */
  std::vector<DampingBand> damping;
  Eigen::VectorXd          ratios;   /* the same, mode by mode; it goes before the bands */
  Eigen::VectorXd deformation, deformation_rate; /* modal coordinates at the start; empty: undeformed */
  bool            fixed_start = false;
};

/* What is done about initial values that violate the constraints, and about constraints that say the same thing twice */
enum class Assembly {
  Off,
  Report, /* a misfit beyond the tolerance is an error that names the elements */
  Project /* bodies and velocities move to the nearest consistent ones in the metric of the masses; fixed_start holds a body. Bodies move as rigid ones; flexible ones deform
             for what that cannot meet, when a run is made, unless their joints lead to a body that is held */
};
enum class Redundant {
  Drop,   /* redundant rows at the start are left out of the run, with a notice */
  Refuse, /* are an error */
  Keep    /* are not looked for */
};
enum class Rotations {
  Local,   /* of bodies in space: U has a rotation vector from the attitude at the last accepted step, V the angular velocity, both in axes of
              space (TSHHT3SetRotations()); for TSHHT3 alone. Attitudes are what Snapshot and measures tell. */
  Euler313 /* 3-1-3 angles and their rates, as the method's authors took them; for any TS type while no body gets new axes */
};
struct StartPolicy {
  Assembly  assembly    = Assembly::Report;  /* -scene_assemble off,report,project */
  double    tolerance   = 1e-6;              /* -scene_assemble_tol: of misfits, times the size of the largest mechanism, bodies that joints hang together and their markers, for lengths; radians */
  Redundant redundant   = Redundant::Drop;   /* -scene_redundant drop,refuse,keep */
  bool      equilibrium = false;             /* -scene_equilibrium: the run starts at rest in static equilibrium */
  bool      view        = false;             /* -scene_view: prints what the start has done */
  double    time        = 0;                 /* -scene_start_time: of the initial values */
  Rotations rotations   = Rotations::Local;  /* -scene_rotations local,euler313 */
  double    angle_tol   = 0;                 /* -scene_angle_tol: of the error test for the rotations of bodies, radians; 0: -ts_atol */
};

struct SceneData; /* src/scene/scene_data.h */
struct Model;     /* src/scene/model.h */

/* Where a marker is: position and axes (columns) */
struct Place {
  Vector3 position;
  Matrix3 axes;
  Place(const Vector3 &p = Vector3::Zero(), const Matrix3 &a = Matrix3::Identity()) : position(p), axes(a) {}
};

/* A number of the description that has a name and may be another one in the next run; Scene::parameter(). Copies are the same one. */
class Parameter
{
public:
  Parameter() = default;
  double value() const { return *value_; }
  operator double() const { return *value_; }

private:
  friend class Scene;
  std::shared_ptr<double> value_ = std::make_shared<double>(0);
};

/* Whether it describes something anew whenever parameters have changed: a function without arguments */
template <class X> constexpr bool is_description = std::is_invocable<const X &>::value;

class Scene
{
public:
  explicit Scene(MPI_Comm comm, Space space = Space::Spatial);
  ~Scene();
  Scene(const Scene &)            = delete;
  Scene &operator=(const Scene &) = delete;

  /* bodies */
  Body ground() const { return Body{-1, number_}; }
  Body add(const std::string &name, const RigidBody &body);
  Body add(const std::string &name, const PointMass &body);
  Body add(const std::string &name, const FlexibleBody &body);

  /* The frame that follows an attachment of a flexible body, its origin at the attachment's point, its axes those of the FE model
     as long as there is no deformation: a body for markers and shapes. It has no unknowns: its motion is a function of the
     body's coordinates, and loads on it act on them. */
  Body attachment(Body flexible, const std::string &name);
  /* The same at a node that the body's file keeps (Reduction::node_sets), by its number in the FE model. Elements that need a
     rotation refuse a node whose neighbours tell none. */
  Body node(Body flexible, PetscInt label);

  /* a marker on a body: position and axes (columns) in body axes from the body's origin; of the ground: in space axes. Made after setUp(), it is of queries
     alone (query.h). */
  Marker marker(Body body, const Vector3 &position = Vector3::Zero(), const Matrix3 &axes = Matrix3::Identity(),
                const std::string &name = "");
  /* the same, given where it is at the start, in space axes */
  Marker markerAt(Body body, const Vector3 &position, const Matrix3 &axes = Matrix3::Identity(), const std::string &name = "");

  /* joints, motions, forces: joints.h, forces.h */
  template <class Spec, std::enable_if_t<!is_description<Spec>, int> = 0> Element add(const std::string &name, const Spec &spec)
  {
    if (recording()) record([=](Scene &s) { s.enter(name, spec); });
    return enter(name, spec);
  }

  /* user-defined variable V = expression; first-order state x' = rate; see functions.h */
  Variable variable(const std::string &name, const Expression &definition, double initial = 0);
  State    state(const std::string &name, const Expression &rate, double initial);

  void gravity(const Vector3 &acceleration);
  /* The ground's acceleration, along the space axes, which go with it: base excitation. All coordinates are relative to the ground, and every mass,
     that of flexible bodies point by point, feels gravity less this acceleration. */
  void groundAcceleration(const TimeFunction &x, const TimeFunction &y, const TimeFunction &z);

  /*
    Parameters: numbers that may be others in the next run, without describing the scene again. They come before everything else.
    What depends on them is given by a function without arguments, which is called whenever they have changed:

      Parameter stiffness = scene.parameter("stiffness", 2e4), arm = scene.parameter("arm", 0.3);
      Marker    i         = scene.marker(body, [=] { return Vector3(arm, 0, 0); });
      scene.add("spring", [=] { return SpringDamper{i, j, stiffness}; });
      for (double k : {1e4, 2e4, 4e4}) {
        PetscCall(scene.set("stiffness", k));
        PetscCall(scene.createTS(&ts));
        ...

    All that was described is then described anew in the same order, so that what follows from it, lengths at the start for
    example, is right. Markers of an element that may be missing are made outside of its function: others than at first are an error. Runs that were made before keep what they had. A function of the state (of an Expression, say) that holds
    a Parameter reads its present value at every evaluation: a controller may change it between steps; after a jump
    TSRestartStep() begins the integrator's history anew. A checkpoint is read with the values it was written with, or names the parameter.
  */
  Parameter      parameter(const std::string &name, double value);
  PetscErrorCode set(const std::string &parameter, double value);
  template <class F, std::enable_if_t<is_description<F>, int> = 0> auto add(const std::string &name, const F &describe)
  {
    if (recording()) record([=](Scene &s) { s.add(name, describe()); });
    const Nested nested(*this);
    return add(name, describe());
  }
  /* An element that may be missing: without a value it has its place among the others, and nothing acts */
  template <class Spec> Element add(const std::string &name, const std::optional<Spec> &spec)
  {
    if (recording()) record([=](Scene &s) { s.add(name, spec); });
    const Nested nested(*this);
    return spec ? add(name, *spec) : absent(name);
  }
  template <class F, std::enable_if_t<is_description<F>, int> = 0> Marker marker(Body body, const F &describe, const std::string &name = "")
  {
    if (recording()) record([=](Scene &s) { s.marker(body, describe, name); });
    const Nested nested(*this);
    const Place p(describe());
    return marker(body, p.position, p.axes, name);
  }
  template <class F, std::enable_if_t<is_description<F>, int> = 0> Marker markerAt(Body body, const F &describe, const std::string &name = "")
  {
    if (recording()) record([=](Scene &s) { s.markerAt(body, describe, name); });
    const Nested nested(*this);
    const Place p(describe());
    return markerAt(body, p.position, p.axes, name);
  }
  template <class F, std::enable_if_t<is_description<F>, int> = 0> void gravity(const F &describe)
  {
    if (recording()) record([=](Scene &s) { s.gravity(describe); });
    const Nested nested(*this);
    gravity(Vector3(describe()));
  }

  /* results, output.h: a channel to sample, a measure or an expression of some; what a body looks like, the ground too; a line through markers, a spring for example */
  Channel         channel(const std::string &name, const Expression &value, const std::string &unit = "");
  void            shape(Body body, const Shape &shape);
  void            line(const std::vector<Marker> &markers);
  void            surface(Body flexible, std::shared_ptr<const Surface> surface); /* in the page; it may be none on all ranks but the first */
  OutputSettings &output() { return output_; }

  /* How the run starts; options come after it */
  StartPolicy &start() { return start_; }

  /* Checks the scene, assembles it, drops redundant constraints, numbers it, looks for static equilibrium, all as start() says;
     collective; called by createTS() when it has not been, and where parameters, start() or options of the start have changed since. After this the
     scene is fixed but for these: what is added later, markers apart, is an error of the next createTS(), solve() or sample(). */
  PetscErrorCode setUp();

  /* A run from the start: a TS of type TSHHT3 with the scene's residual, Jacobian, roles and initial state; the caller destroys it.
     Set final time, step and options on it as on any TS. It owns all that changes in the run, so that any number of runs may go on
     side by side, and outlive the scene. Where several write results, each TS gets a prefix of its own, or output() other names before its solve(). */
  PetscErrorCode createTS(TS *ts);

  /* A run that goes on where another one of this scene is: its time, positions, velocities and states, angles over full turns; with
     parameters, and elements that may be missing, as they are now. Velocities that joints of now forbid are lost, in the metric of
     the mass matrix, as in a plastic impact, unless start().assembly is Off; positions that they forbid are an error as at any start.
     Elements that count angles over full turns or follow a curve may not come or go, which is an error: torsional springs, RotationalStop, Screw, Coupler,
     gears, racks, PointOnCurve, constraints and forces of the user's that read angles. RotationalMotion may, but not one of accelerations.
     Files are begun anew: give the run other names, or its TS a prefix. */
  PetscErrorCode createTS(TS *ts, TS from);

  /* TSSolve(), output. */
  PetscErrorCode solve(TS ts);

  /* Values of all channels, in their order, on every rank: at time t between the ends of the last step, after scene.solve() or in a
     monitor; before the first step at the start. Collective. */
  PetscErrorCode sample(TS ts, PetscReal t, std::vector<double> &values);

  PetscErrorCode view(PetscViewer viewer) const;

private:
  friend struct SceneAccess; /* for the library's own rooms and for tests */
  struct Journal; /* what was described, call by call */
  struct Nested {  /* what is called inside of another call is not noted */
    Scene &scene;
    explicit Nested(Scene &s) : scene(s) { scene.nested_++; }
    ~Nested() { scene.nested_--; }
  };

  PetscInt                 number_; /* of this scene, in the handles that it gives */
  std::shared_ptr<Model>   model_;
  std::unique_ptr<Journal> journal_;
  StartPolicy              start_;
  OutputSettings           output_;
  int                      nested_ = 0;

  template <class Spec> Element enter(const std::string &name, const Spec &spec);
  bool       recording() const { return journal_ && !nested_; }
  void       record(std::function<void(Scene &)> call);
  SceneData &data() const;
  Element    absent(const std::string &name);
  Body       addRigid(const std::string &name, const RigidBody &body);
  Body       frameAt(Body flexible, PetscInt place);
  Body       addFrame(Body flexible, PetscInt place);
  void       describeAnew();
};

} // namespace hhtdae

#endif
