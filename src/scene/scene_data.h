/* A scene as its user describes it: the same on every rank, before anything is numbered. */
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
  std::vector<double>              damping, deformation, deformation_rate; /* ratios, modal coordinates at the start */
  PetscInt                         frame = -1;                             /* marker of the floating frame, for modal loads and contacts of nodes */

  /* Points to which markers can be attached: attachments, then kept nodes */
  const ModalAttachment &place(PetscInt k) const
  {
    const std::size_t n = model->attachments.size(), i = (std::size_t)k;
    return i < n ? model->attachments[i] : model->nodes[i - n];
  }
};
Eigen::VectorXd ModalDamping(const FlexibleData &f); /* 2 zeta omega */

struct BodyData {
  std::string name;
  bool        point = false, fixed_start = false;
  double      mass = 0;
  Matrix3     inertia;  /* about the centre of mass, body axes */
  Vector3     center;   /* of mass, from the body's origin, body axes */
  Vector3     r;        /* centre of mass at the start */
  Matrix3     A;        /* body axes at the start */
  Vector3     v, w;     /* at the start, space axes */
  std::shared_ptr<const FlexibleData> flexible; /* of a flexible body; then the rest belongs to its floating frame, undeformed */
  PetscInt                            carrier = -1, attachment = -1;     /* if this is the frame of an attachment or node: its flexible body and number in FlexibleData::place(); it has no coordinates in a run */
  bool                                forces_alone = false;              /* the frame of a node whose rotation its neighbours do not determine: it takes forces, no moments */
  bool                                massless     = false;              /* the frame of an attachment, of a flexible body or of an extension */
  double                              light_mass = 0, light_inertia = 0; /* least mass and moments of inertia in the metric of assembly, FillLight() */
};

struct MarkerData {
  PetscInt body; /* -1: ground, -2: invalid */
  Vector3  s;    /* from the centre of mass, body axes */
  Matrix3  R;    /* axes, in body axes */
};

/* A scalar unknown of the scene, by its meaning for the user */
struct ScalarRef {
  enum Kind { Multiplier, ForceState, Variable, State, Modal } kind = Variable;
  PetscInt id        = -1; /* element, variable, state or flexible body */
  PetscInt component = 0;  /* row of the element's constraints, in the order of its parts; component of its force; mode */
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
  Marker            i, j; /* of the element; reactions are given on i's body */
  std::vector<Part> parts;
};

struct ExpressionData { /* variable or state */
  std::string name;
  Expression  expression;
  double      initial;
  bool        reached = false; /* `initial` is from a run */
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
  PetscInt                       body;    /* a flexible one */
  std::shared_ptr<const Surface> surface; /* read on the first rank alone */
};

/* Results of assembly, redundancy check and equilibrium */
struct StartResult {
  struct Row {
    PetscInt element;
    int      row; /* among the element's rows */
  };
  PetscInt         coordinates = 0, rows = 0, core = 0; /* rows: of constraints; core: rows left after tree structures were removed */
  PetscInt         redundant = 0;                       /* rows, dropped or not */
  std::vector<Row> dropped;
  double           misfit = 0, velocity_misfit = 0; /* largest violation of an element's constraints, relative to the mechanism's size and to `speed` */
  double           speed = 0;                       /* largest speed of the scene */
  double           moved = 0, turned = 0;           /* largest displacement and rotation (rad) of a body by assembly or equilibrium */
  PetscInt         assembly_iterations = 0, equilibrium_iterations = 0;
  PetscInt         degreesOfFreedom() const { return coordinates - (rows - redundant); }
};

/* `described`: value with which elements were described; functions read the present one. Checkpoints have both */
struct ParameterData {
  std::string                   name;
  std::shared_ptr<const double> present;
  double                        described;
};

struct SceneData {
  PetscInt                                              number = 0; /* of the scene, stored in its handles */
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
  std::vector<std::vector<PetscInt>> lines; /* of markers, in the animation */
  std::vector<ParameterData>  parameters;
  std::vector<std::string>    errors; /* found while the scene was described */
  std::set<std::string>       told;   /* notices that were printed, which runs with other parameters do not repeat */
  StartPolicy                                           start;  /* with options */
  StartResult                 started;
  bool                                                  fixed        = false; /* from setUp() on nothing may be added but markers for queries */
  std::size_t                                           markers_then = 0;     /* number of markers at that time */

  SceneData();
  ~SceneData();
  /* The body on which an element acts: `body`, or, if `body` is an attachment on which it does not act, its flexible body (on whose modes it may act); -2: neither.
     elsewhere: in the latter case another attachment of that flexible body on which the element acts, or -1 */
  PetscInt    loadedBody(const ElementData &e, PetscInt body, PetscInt *elsewhere = nullptr) const;
  std::string bodyName(PetscInt b) const { return b < 0 ? "ground" : bodies[b].name; }
  /* Whether a body takes no moments; its name in messages then */
  bool        turnless(PetscInt b) const { return b >= 0 && (bodies[b].point || bodies[b].forces_alone); }
  std::string turnlessName(PetscInt b) const
  {
    return bodies[b].point ? "the point mass " + bodies[b].name : bodies[b].name + ", a node whose neighbours tell no rotation";
  }
  /* Whether a handle is of this scene. Number 0 stands for a handle made by hand. */
  template <class Handle> bool mine(Handle h) const { return h.scene == 0 || h.scene == number; }
  std::size_t ownMarkers() const { return fixed ? markers_then : markers.size(); }
  bool valid(Marker m) const { return mine(m) && m.id >= 0 && m.id < (PetscInt)markers.size(); }
  bool valid(Body b) const { return mine(b) && b.id >= 0 && b.id < (PetscInt)bodies.size(); }
  bool valid(Element e) const { return mine(e) && e.id >= 0 && e.id < (PetscInt)elements.size(); }
  void refuseLate(const std::string &what) /* an error if the scene is fixed already */
  {
    if (fixed) errors.push_back(what + " came too late: the scene is fixed from its set-up or first run on");
  }
  Vector3 gravityAt(double t) const; /* minus the ground's acceleration */
  /* at the start */
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
  int  slidingAxis(int axis) const { return planar() && axis == 2 ? 0 : axis; } /* of j: z, the default, is x in a planar scene, along which Translational slides */
  bool good() const { return good_; } /* no error so far: i and j are markers */
  void require(bool condition, const std::string &message); /* "stiffness is -3, must not be negative" */
  void require(Marker m, const char *what);                 /* m is a marker of this scene */
  Frame<double>    frame(Marker m) const { return data_.frame(m); } /* at the start; only if good() */
  const SceneData &scene() const { return data_; }
  bool             coincident(Marker i, Marker j) const; /* at the start, up to rounding of the positions */

  /* a constraint kernel on these markers; returns the first of its rows among the element's rows */
  template <class K> PetscInt constrain(std::initializer_list<Marker> markers, const typename K::Data &data = {});
  template <class K> PetscInt constrain(const std::vector<Marker> &markers, const typename K::Data &data, const std::vector<ScalarRef> &inputs);
  /* a force kernel; inputs: the scalars z of components(); state: the components become force states */
  template <class K>
  void load(std::initializer_list<Marker> markers, const typename K::Data &data = {}, const std::vector<ScalarRef> &inputs = {},
            bool state = false);

  /* an instance of a store of another kind */
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
