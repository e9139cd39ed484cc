/* A scene as its user describes it, before unknowns are numbered; every rank has the same complete description. */
#ifndef HHTDAE_SCENE_DATA_H
#define HHTDAE_SCENE_DATA_H

#include "frames.h"
#include "hhtdae/scene.h"
#include "kernel.h"
#include <cstdio>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <typeindex>
#include <vector>

namespace hhtdae
{

struct FlexibleData {
  std::shared_ptr<const ModalBody> model;
  ModalMass                        mass;
  /* of each mode: damping ratio; modal coordinate and its rate at the start */
  std::vector<double>              damping, deformation, deformation_rate;
  PetscInt                         frame = -1;                             /* marker of the floating frame, for modal loads and contacts of nodes */

  /* The k-th point to which markers can be attached; attachments come first, then kept nodes */
  const ModalAttachment &place(PetscInt k) const
  {
    const std::size_t n = model->attachments.size(), i = (std::size_t)k;
    return i < n ? model->attachments[i] : model->nodes[i - n];
  }
};
Eigen::VectorXd ModalDamping(const FlexibleData &f); /* 2 zeta omega of each mode, 1/s */

struct BodyData {
  std::string name;
  bool        point = false, fixed_start = false;
  double      mass = 0;
  Matrix3     inertia;  /* about the centre of mass, body axes */
  Vector3     center;   /* centre of mass relative to the body's origin, body axes */
  Vector3     r;        /* centre of mass at the start */
  Matrix3     A;        /* body axes at the start */
  Vector3     v, w;     /* velocity of the centre of mass and angular velocity at the start, space axes */
  /* null for rigid bodies; for a flexible body the other members describe the undeformed body and its floating frame */
  std::shared_ptr<const FlexibleData> flexible;
  /* if this body is the frame of an attachment or node: its flexible body, and its number in FlexibleData::place(); in a
     run the frame has no coordinates */
  PetscInt                            carrier = -1, attachment = -1;
  /* the frame of a node whose rotation the neighbouring nodes do not determine: forces, but no moments, may act on it */
  bool                                forces_alone = false;
  bool                                massless     = false;              /* the frame of an attachment of a flexible body or of an extension */
  double                              light_mass = 0, light_inertia = 0; /* least mass and moments of inertia in the metric of assembly, FillLight() */
};

struct MarkerData {
  PetscInt body; /* -1: ground, -2: invalid */
  Vector3  s;    /* position relative to the centre of mass, body axes */
  Matrix3  R;    /* axes, in body axes */
};

/* A scalar unknown of the scene, by its meaning for the user */
struct ScalarRef {
  enum Kind { Multiplier, ForceState, Variable, State, Modal } kind = Variable;
  PetscInt id        = -1; /* element, variable, state or flexible body */
  /* Multiplier: row among all rows of the element, in the order of its parts; ForceState: component of the force; Modal:
     mode */
  PetscInt component = 0;
};

class StoreBase; /* all instances of one kernel, store.h */
class Extension; /* unknowns of other kinds, extension.h */

/* A number as text, for messages */
inline std::string Show(double x)
{
  char text[32];
  std::snprintf(text, sizeof text, "%g", x);
  return text;
}

/* One kernel instance of an element */
struct Part {
  StoreBase *store;
  PetscInt   index;
};

struct ElementData {
  enum Kind { Joint, Motion, Force };
  std::string       name;
  const char       *type; /* "revolute" */
  Kind              kind = Force;
  Marker            i, j; /* reactions are those on i's body */
  std::vector<Part> parts;
};

struct ExpressionData { /* variable or state */
  std::string name;
  Expression  expression;
  double      initial;
  bool        reached = false; /* `initial` was computed by a run (state.cpp), not given by the user */
};

struct ChannelData {
  std::string name, unit;
  Expression  value;
};

struct ShapeData {
  PetscInt body;
  Shape    shape;
};

struct SurfaceData {
  PetscInt                       body;    /* a flexible body */
  std::shared_ptr<const Surface> surface; /* only the first rank reads it */
};

/* Results of assembly, redundancy check and equilibrium */
struct StartResult {
  struct Row {
    PetscInt element;
    int      row; /* among the element's rows */
  };
  /* numbers of coordinates, of rows of constraints, and of the rows left after tree structures were removed */
  PetscInt         coordinates = 0, rows = 0, core = 0;
  PetscInt         redundant = 0;                       /* number of redundant rows, dropped or not */
  std::vector<Row> dropped;
  double           misfit = 0, velocity_misfit = 0; /* largest violation of an element's constraints, relative to the mechanism's size and to `speed` */
  double           speed = 0;                       /* largest speed of the scene */
  double           moved = 0, turned = 0;           /* largest displacement and rotation (rad) of a body by assembly or equilibrium */
  PetscInt         assembly_iterations = 0, equilibrium_iterations = 0;
  PetscInt         degreesOfFreedom() const { return coordinates - (rows - redundant); }
};

/* described: the value with which elements were described; present: the value that functions read during a run. Checkpoints store both. */
struct ParameterData {
  std::string             name;
  std::shared_ptr<double> present;
  double                  described;
};

struct SceneData {
  PetscInt                                              number = 0; /* number of the scene, which its handles contain */
  MPI_Comm                    comm;
  bool                        planar = false;
  std::vector<BodyData>       bodies;
  std::vector<MarkerData>     markers;
  std::map<PetscInt, std::string> marker_names;
  std::vector<ElementData>    elements;
  std::vector<ExpressionData> variables, states;
  std::map<std::type_index, std::unique_ptr<StoreBase>> stores;
  std::vector<StoreBase *>                              order; /* stores in the order of first use, which is the order of evaluation */
  std::vector<std::unique_ptr<Extension>> extensions;
  Vector3                     gravity = Vector3::Zero();
  std::vector<TimeFunction>   ground_acceleration; /* along the space axes; empty: none */
  std::vector<ChannelData>    channels;
  std::vector<ShapeData>      shapes;
  std::vector<SurfaceData>    surfaces;
  std::vector<std::vector<PetscInt>> lines; /* polygons through markers, drawn in animations and pages */
  std::vector<ParameterData>  parameters;
  std::vector<std::string>    errors; /* found while the scene was described */
  std::set<std::string>       told;   /* notices that were printed, which runs with other parameters do not repeat */
  StartPolicy                                           start;  /* as changed by options */
  StartResult                 started;
  bool                                                  fixed        = false; /* true from setUp() on: only markers for queries may be added then */
  std::size_t                                           markers_then = 0;     /* number of markers at the end of setUp() */

  SceneData();
  ~SceneData();
  /* The body on which element e acts: `body`; or, if `body` is the frame of an attachment on which e does not act, the
     flexible body of that attachment if e acts on it (on its modes); -2 if e acts on neither. elsewhere: if -2 is
     returned, another attachment of that flexible body on which e acts, or -1 */
  PetscInt    loadedBody(const ElementData &e, PetscInt body, PetscInt *elsewhere = nullptr) const;
  std::string bodyName(PetscInt b) const { return b < 0 ? "ground" : bodies[b].name; }
  /* Whether no moment can act on a body because it has no rotation; the name of such a body in messages */
  bool        turnless(PetscInt b) const { return b >= 0 && (bodies[b].point || bodies[b].forces_alone); }
  std::string turnlessName(PetscInt b) const
  {
    return bodies[b].point ? "the point mass " + bodies[b].name : bodies[b].name + ", a node whose neighbours tell no rotation";
  }
  /* Whether a handle belongs to this scene. A handle that was not returned by a scene has the number 0 and is accepted. */
  template <class Handle> bool mine(Handle h) const { return h.scene == 0 || h.scene == number; }
  std::size_t ownMarkers() const { return fixed ? markers_then : markers.size(); }
  bool valid(Marker m) const { return mine(m) && m.id >= 0 && m.id < (PetscInt)markers.size(); }
  bool valid(Body b) const { return mine(b) && b.id >= 0 && b.id < (PetscInt)bodies.size(); }
  bool valid(Element e) const { return mine(e) && e.id >= 0 && e.id < (PetscInt)elements.size(); }
  void refuseLate(const std::string &what) /* an error if the scene is fixed already */
  {
    if (fixed) errors.push_back(what + " came too late: the scene is fixed from its set-up or first run on");
  }
  Vector3 gravityAt(double t) const; /* gravity minus the ground's acceleration */
  /* Pose and velocity of a marker at the start, as described */
  Frame<double> frame(Marker m) const;
  Twist<double> twist(Marker m) const;
};

/* Prints a notice, once for all runs of the scene. The text is the same on all ranks. */
PetscErrorCode TellOnce(SceneData &s, const std::string &text);

/*
  Enters a joint or force into the scene:

    template <> Element Scene::enter(const std::string &name, const Revolute &s)
    {
      ElementBuilder e(*this, name, "revolute", ElementData::Joint, s.i, s.j);
      e.constrain<Coincide>({s.i, s.j});
      e.constrain<Parallel>({s.i, s.j});
      return e.done();
    }

  Errors are collected, with the element's type and name in front; an element with errors gets no parts.
*/
class ElementBuilder
{
public:
  /* pair: whether the element has a marker j */
  ElementBuilder(Scene &scene, const std::string &name, const char *type, ElementData::Kind kind, Marker i, Marker j, bool pair = true);

  bool planar() const { return data_.planar; }
  /* axis of j along which Translational slides; z, the default, is replaced by x in a planar scene */
  int  slidingAxis(int axis) const { return planar() && axis == 2 ? 0 : axis; }
  bool good() const { return good_; } /* no error so far; then i and j are valid markers */
  /* adds `message`, such as "stiffness is -3, must not be negative", unless the condition holds */
  void require(bool condition, const std::string &message);
  void require(Marker m, const char *what);                 /* adds an error unless m is a marker of this scene */
  Frame<double>    frame(Marker m) const { return data_.frame(m); } /* the marker's frame at the start; only if good() */
  const SceneData &scene() const { return data_; }
  bool             coincident(Marker i, Marker j) const; /* whether the markers coincide at the start, up to rounding of the positions */

  /* Adds an instance of a constraint kernel on these markers; returns the number of its first row among the element's rows */
  template <class K> PetscInt constrain(std::initializer_list<Marker> markers, const typename K::Data &data = {});
  template <class K> PetscInt constrain(const std::vector<Marker> &markers, const typename K::Data &data, const std::vector<ScalarRef> &inputs);
  /* Adds an instance of a force kernel; inputs: the scalars z of components(); state: the components become force states */
  template <class K>
  void load(std::initializer_list<Marker> markers, const typename K::Data &data = {}, const std::vector<ScalarRef> &inputs = {},
            bool state = false);

  /* Adds an item to a store that is neither a ConstraintStore nor a ForceStore, such as AttachStore */
  template <class S> void put(typename S::Item item);

  Element done();

private:
  SceneData  &data_;
  ElementData element_;
  PetscInt    rows_ = 0;
  bool        good_ = true;
  template <class S> S &store();
};

} // namespace hhtdae

#include "store.h"

#endif
