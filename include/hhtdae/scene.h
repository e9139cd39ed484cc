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

  Any consistent units may be used; angles are in radians. Building a scene never fails: all errors of the description are reported at once,
  by name, as one PETSc error of setUp(), createTS() or solve(), whichever is called first. Exceptions of the user's own functions, those that
  describe and those that add() tries (laws of springs, motions in time), pass through add(), marker(), markerAt() and gravity(), which then have
  added nothing. Every rank describes the same scene in the same order; METIS distributes the bodies over the ranks.

  Messages and results identify things by name. Two bodies, elements (joints, motions and forces together), variables, states or channels
  with the same name are an error. An empty name becomes that of the kind (for an element: of its type) with the number among all of the
  kind, counted from 0: "body 7", "revolute 3", "spring-damper 4", "variable 0", "state 0", "channel 2". A motion of accelerations called
  "drive" makes a state "drive speed". Names of markers are used in messages only and may repeat.

  Options of the start (StartPolicy) and of the linear solvers of start and analyses (analyses.h) do not have the prefix of the TS. Options of
  results (output.h) have it, as -ts_ options do: after TSSetOptionsPrefix(ts, "a_") -scene_csv is -a_scene_csv.
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
#include <exception>
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

struct RigidBody { /* mass or moments of inertia may be zero where joints and motions determine the motion that would have no inertia */
  double  mass    = 1;
  Matrix3 inertia = Matrix3::Identity();  /* about the centre of mass, in body axes; planar: element (2,2) alone counts */
  Vector3 position = Vector3::Zero();     /* of the body's origin at the start, space axes */
  Matrix3 rotation = Matrix3::Identity(); /* body axes as columns, at the start */
  Vector3 velocity = Vector3::Zero();     /* of the centre of mass, space axes */
  Vector3 angular_velocity = Vector3::Zero(); /* space axes */
  Vector3 center = Vector3::Zero();       /* of mass, in body axes from the body's origin */
  bool    fixed_start = false;            /* the assembly at the start does not change position, rotation and velocities */
};

struct PointMass { /* 3 coordinates, planar 2, no rotation: elements that would exert a moment on it are an error */
  double  mass     = 1;
  Vector3 position = Vector3::Zero();
  Vector3 velocity = Vector3::Zero();
  bool    fixed_start = false;
};

struct DampingBand { /* modes up to this frequency, in cycles per unit of time */
  double below, ratio;
};

/*
  A flexible body has 6 + modes coordinates: those of its floating frame, whose origin is the undeformed centre of mass, and the modal
  coordinates of its model. Joints, forces and markers act at its attachments and kept nodes, Scene::attachment() and node(); distributed
  loads are ModalLoad and gravity.
*/
struct FlexibleBody {
  std::shared_ptr<const ModalBody> model;
  Vector3   position         = Vector3::Zero();     /* of the origin of the FE model at the start, space axes */
  Matrix3   rotation         = Matrix3::Identity(); /* axes of the FE model as columns, at the start */
  Vector3   velocity         = Vector3::Zero();     /* of the undeformed centre of mass, space axes */
  Vector3   angular_velocity = Vector3::Zero();     /* space axes */
  ModalMass mass             = ModalMass::Full;
  /* Modal damping ratios (of critical damping), by bands of increasing frequency; the last ratio also applies beyond the last band; empty:
     no damping. Ratios and frequencies are those of the model's modes, which are of the free body. The modes of the body as held in the
     scene are slower, and less damped (the first of a cantilever by a fourteenth of the ratio). */
  std::vector<DampingBand> damping;
  Eigen::VectorXd          ratios;   /* damping ratios mode by mode; overrides `damping` */
  Eigen::VectorXd deformation, deformation_rate; /* modal coordinates at the start; empty: undeformed */
  bool            fixed_start = false;
};

/* Treatment of initial values that violate the constraints */
enum class Assembly {
  Off,
  Report, /* constraint residuals beyond the tolerance are an error that names the elements */
  Project /* positions and velocities are moved to the nearest consistent ones in the metric of the masses, except those of bodies with
             fixed_start. Bodies move as rigid bodies. Where this cannot meet the constraints, flexible bodies deform when a run is made,
             unless joints connect them to a body with fixed_start */
};
/* Treatment of constraints that are redundant at the start */
enum class Redundant {
  Drop,   /* redundant rows are left out of the run, with a notice */
  Refuse, /* redundant rows are an error */
  Keep    /* redundancy is not checked */
};
/* Coordinates for the rotation of bodies in space */
enum class Rotations {
  Local,   /* U has the rotation vector from the attitude at the last accepted step, V the angular velocity, both in space axes
              (TSHHT3SetRotations()); for TSHHT3 only. Attitudes are read with Snapshot and measures. */
  Euler313 /* 3-1-3 angles and their rates, as in the paper; for any TS type as long as no body gets new axes during the run */
};
struct StartPolicy {
  Assembly  assembly    = Assembly::Report;  /* -scene_assemble off,report,project */
  /* -scene_assemble_tol: largest constraint residual that counts as met; angles in radians, lengths relative to the size of the largest
     mechanism (a group of bodies connected by joints, with their markers) */
  double    tolerance   = 1e-6;
  Redundant redundant   = Redundant::Drop;   /* -scene_redundant drop,refuse,keep */
  bool      equilibrium = false;             /* -scene_equilibrium: the run starts at rest in static equilibrium, where friction holds nothing, see analyses.h */
  bool      view        = false;             /* -scene_view: prints what the start has done */
  double    time        = 0;                 /* -scene_start_time: time of the initial values */
  Rotations rotations   = Rotations::Local;  /* -scene_rotations local,euler313 */
  double    angle_tol   = 0;                 /* -scene_angle_tol: tolerance of the error test for rotations of bodies, radians; 0: -ts_atol */
};

struct SceneData; /* src/scene/scene_data.h */
struct Model;     /* src/scene/model.h */

/* Position and axes (columns) of a marker */
struct Place {
  Vector3 position;
  Matrix3 axes;
  Place(const Vector3 &p = Vector3::Zero(), const Matrix3 &a = Matrix3::Identity()) : position(p), axes(a) {}
};

/* A named number of the description whose value may change from run to run; made by Scene::parameter(). Copies refer to the same number. */
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

/* True for functions without arguments: they describe something and are called again whenever parameters have changed */
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

  /* A frame that follows an attachment of a flexible body, to be used as a body for markers and shapes. Its origin is the attachment's point;
     undeformed, its axes are those of the FE model. The frame has no unknowns: its motion is a function of the flexible body's coordinates,
     and loads on the frame act on these. */
  Body attachment(Body flexible, const std::string &name);
  /* The same at a node that the body's file keeps (Reduction::node_sets), by its label in the FE model. Elements that need a rotation are
     an error at a node whose neighbours do not determine one. */
  Body node(Body flexible, PetscInt label);

  /* A marker on a body: position and axes (columns) in body axes from the body's origin; on the ground: in space axes. A marker made after
     setUp() can be used in queries only (query.h). */
  Marker marker(Body body, const Vector3 &position = Vector3::Zero(), const Matrix3 &axes = Matrix3::Identity(),
                const std::string &name = "");
  /* The same, with position and axes at the start in space axes */
  Marker markerAt(Body body, const Vector3 &position, const Matrix3 &axes = Matrix3::Identity(), const std::string &name = "");

  /* joints, motions, forces: joints.h, forces.h */
  template <class Spec, std::enable_if_t<!is_description<Spec>, int> = 0> Element add(const std::string &name, const Spec &spec)
  {
    if (recording()) record([=](Scene &s) { s.enter(name, spec); });
    const Attempt attempt(*this);
    return enter(name, spec);
  }

  /* user-defined variable V = expression; first-order state x' = rate; see functions.h */
  Variable variable(const std::string &name, const Expression &definition, double initial = 0);
  State    state(const std::string &name, const Expression &rate, double initial);

  void gravity(const Vector3 &acceleration);
  /* Base excitation: acceleration of the ground along the space axes, which move with the ground. All coordinates are relative to the ground;
     gravity less this acceleration acts on every mass (of flexible bodies: at every point). */
  void groundAcceleration(const TimeFunction &x, const TimeFunction &y, const TimeFunction &z);

  /*
    Parameters are numbers whose values may change from run to run, without describing the scene again. They have to be defined before
    everything else. Whatever depends on parameters is described by a function without arguments, which is called whenever they have changed:

      Parameter stiffness = scene.parameter("stiffness", 2e4), arm = scene.parameter("arm", 0.3);
      Marker    i         = scene.marker(body, [=] { return Vector3(arm, 0, 0); });
      scene.add("spring", [=] { return SpringDamper{i, j, stiffness}; });
      for (double k : {1e4, 2e4, 4e4}) {
        PetscCall(scene.set("stiffness", k));
        PetscCall(scene.createTS(&ts));
        ...

    Then the whole scene is described anew in the same order, so that values derived from the description, such as lengths at the start, are
    right. Markers of an element that may be missing must be made outside of its function: markers other than at first are an error. Runs
    made before keep their values. A function of the state (in an Expression, for example) that holds a Parameter reads the present value
    at every evaluation, so that a controller may change it between steps; after a jump call TSRestartStep(), as solve() does by itself if
    parameters have been set since it ended last. A checkpoint can only be loaded with the parameter values it was written with; otherwise an error names the parameter.
  */
  Parameter      parameter(const std::string &name, double value);
  PetscErrorCode set(const std::string &parameter, double value);
  template <class F, std::enable_if_t<is_description<F>, int> = 0> auto add(const std::string &name, const F &describe)
  {
    if (recording()) record([=](Scene &s) { s.add(name, describe()); });
    const Attempt attempt(*this);
    return add(name, describe());
  }
  /* An element that may be missing: without a value it keeps its number among the elements, but does not act */
  template <class Spec> Element add(const std::string &name, const std::optional<Spec> &spec)
  {
    if (recording()) record([=](Scene &s) { s.add(name, spec); });
    const Attempt attempt(*this);
    return spec ? add(name, *spec) : absent(name);
  }
  template <class F, std::enable_if_t<is_description<F>, int> = 0> Marker marker(Body body, const F &describe, const std::string &name = "")
  {
    if (recording()) record([=](Scene &s) { s.marker(body, describe, name); });
    const Attempt attempt(*this);
    const Place p(describe());
    return marker(body, p.position, p.axes, name);
  }
  template <class F, std::enable_if_t<is_description<F>, int> = 0> Marker markerAt(Body body, const F &describe, const std::string &name = "")
  {
    if (recording()) record([=](Scene &s) { s.markerAt(body, describe, name); });
    const Attempt attempt(*this);
    const Place p(describe());
    return markerAt(body, p.position, p.axes, name);
  }
  template <class F, std::enable_if_t<is_description<F>, int> = 0> void gravity(const F &describe)
  {
    if (recording()) record([=](Scene &s) { s.gravity(describe); });
    const Attempt attempt(*this);
    gravity(Vector3(describe()));
  }

  /* Results, see output.h: a channel samples a measure or an expression of measures; a shape shows a body (or the ground); a line through
     markers shows a spring, for example */
  Channel         channel(const std::string &name, const Expression &value, const std::string &unit = "");
  void            shape(Body body, const Shape &shape);
  void            line(const std::vector<Marker> &markers);
  void            surface(Body flexible, std::shared_ptr<const Surface> surface); /* for the page; only rank 0 needs it, others may pass null */
  OutputSettings &output() { return output_; }

  /* How the run starts; options override it */
  StartPolicy &start() { return start_; }

  /* Checks the scene, assembles it, drops redundant constraints, numbers the unknowns and finds static equilibrium, as start() says.
     Collective. createTS() calls it if it has not been called, or if parameters, start() or options of the start have changed since. After
     this only these may change: whatever else is added later, except markers, is an error of the next createTS(), solve() or sample(). */
  PetscErrorCode setUp();

  /* A run from the start: a TS of type TSHHT3 with the scene's residual, Jacobian, roles and initial state; the caller destroys it.
     Set final time, step and options on it as on any TS. The TS owns everything that changes during the run: any number of runs can
     alternate, and they may outlive the scene. If several runs write results, give each TS its own prefix, or change the names in output()
     before its solve(). */
  PetscErrorCode createTS(TS *ts);

  /* A run that continues from the present state of another run of this scene: with its time, positions, velocities, states and angles over
     full turns, but with the present parameters and elements that may be missing. Velocities that violate the present joints are projected
     in the metric of the mass matrix, as in a plastic impact, unless start().assembly is Off; positions that violate them are an error as
     at any start. What an element takes from the start (the length of a PointDistance, the value that a Gear, RackAndPinion, Coupler, Screw or mesh
     keeps) stays as it is; of a PointDistance that comes, and of a coupler or mesh whose ratio, radius, factors or pitch have changed, it is that of
     the present positions, so that none of these moves a body. Elements that count angles over full turns or follow a curve must not appear or disappear: torsional springs,
     RotationalStop, Screw, Coupler, gears, racks, PointOnCurve, user constraints and forces that read angles. A RotationalMotion may,
     unless it prescribes accelerations. Result files are overwritten: give the run other names, or its TS a prefix. */
  PetscErrorCode createTS(TS *ts, TS from);

  /* TSSolve() with output of the results. If parameters have been set since it ended last, it begins anew from consistent accelerations. A
     motion or constraint of positions that has jumped is then an error; with -ts_hhtdae_start project the positions are moved to the nearest ones that meet it. */
  PetscErrorCode solve(TS ts);

  /* Values of all channels, in the order of their definition, on every rank: at time t within the last step, after scene.solve() or in a
     monitor; before the first step at the start. Collective. */
  PetscErrorCode sample(TS ts, PetscReal t, std::vector<double> &values);

  PetscErrorCode view(PetscViewer viewer) const;

private:
  friend struct SceneAccess; /* for the library's own sources and for tests */
  struct Journal; /* calls of the description, recorded in order, to be repeated when parameters change */
  struct Nested {  /* while one exists, calls are made inside another call and are not recorded */
    Scene &scene;
    explicit Nested(Scene &s) : scene(s) { scene.nested_++; }
    ~Nested() { scene.nested_--; }
  };
  class Attempt /* guards a call that has just been recorded: if a user's function throws in it, the scene is set back to its state before */
  {
  public:
    explicit Attempt(Scene &s) : noted_(s.recording()), exceptions_(std::uncaught_exceptions()), nested_(s) {}
    ~Attempt()
    {
      if (noted_ && std::uncaught_exceptions() > exceptions_) nested_.scene.takeBack();
    }

  private:
    const bool   noted_;
    const int    exceptions_;
    const Nested nested_;
  };

  PetscInt                 number_; /* of this scene: `scene` of its handles */
  std::shared_ptr<Model>   model_;
  std::unique_ptr<Journal> journal_;
  StartPolicy              start_;
  OutputSettings           output_;
  int                      nested_ = 0;

  template <class Spec> Element enter(const std::string &name, const Spec &spec);
  bool       recording() const { return journal_ && !nested_; }
  void       record(std::function<void(Scene &)> call);
  void       takeBack(); /* the call that was recorded last */
  SceneData &data() const;
  Element    absent(const std::string &name);
  Body       addRigid(const std::string &name, const RigidBody &body);
  Body       frameAt(Body flexible, PetscInt place);
  Body       addFrame(Body flexible, PetscInt place);
  void       describeAnew();
  void       repeatCalls();
};

} // namespace hhtdae

#endif
