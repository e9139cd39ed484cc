/*
  Flexible bodies from linear finite-element models: stiffness and mass matrices with nodes and elements, from a mesh, from another FE
  program or from memory; Craig-Bampton reduction by SLEPc to a body in modal coordinates; files of reduced bodies; stress recovery.

    FeModel model(PETSC_COMM_WORLD);
    PetscCall(model.readMesh("frame.msh", {{"steel", Material{2.1e11, 0.3, 7850}}}));
    Reduction reduction;
    reduction.attachments = {{"hub", "hub nodes"}, {"tip", "tip nodes", Tie::Average}};
    reduction.modes       = 20;
    ReducedBody body;
    PetscCall(Reduce(model, reduction, &body));
    PetscCall(body.save("frame.h5"));

  Any consistent units may be used. All functions that return PetscErrorCode are collective on the model's communicator.
*/
#ifndef HHTDAE_FLEXIBLE_H
#define HHTDAE_FLEXIBLE_H

#include "hhtdae/scene.h"
#include <map>
#include <memory>
#include <petscmat.h>
#include <petscviewer.h>
#include <string>
#include <vector>

namespace hhtdae
{

/* ---- the finite-element model ---- */

struct Material { /* isotropic, linear elastic */
  double young = 0, poisson = 0, density = 0;
};

enum class ElementType : unsigned char { Tetrahedron4, Tetrahedron10, Brick8, Brick20 };
constexpr int FeNodes(ElementType t) { return t == ElementType::Tetrahedron4 ? 4 : t == ElementType::Tetrahedron10 ? 10 : t == ElementType::Brick8 ? 8 : 20; }

/* Nodes in the order of Gmsh: corners, then midpoints of edges */
struct FeElement {
  ElementType  type;
  PetscInt     material; /* index into FeModel::materials */
  PetscInt     node[20]; /* global numbers of nodes */
};

/*
  Three translations per node; rank r has nodes [first, first + own). Node n has the rows 3 n .. 3 n + 2 of K and M; both are symmetric AIJ
  matrices with both triangles, K without supports. Elements are needed for stress, pictures, pressure (LoadCase::surface), stiffening
  (Reduction::stiffening) and FeLaw::Large, which uses the elements only; everything else is computed from K and M.
*/
struct FeModel {
  MPI_Comm    comm;
  std::string source;                    /* file or program it came from */
  PetscInt    nodes = 0, own = 0, first = 0;
  std::vector<double>   coordinates;     /* 3 per own node */
  std::vector<PetscInt> label;           /* numbers of the own nodes in the mesh or the other program */
  Mat         K = nullptr, M = nullptr;
  std::map<std::string, std::vector<PetscInt>> sets; /* own nodes of a named set, by global number, sorted; the same names on all ranks */
  std::vector<Material>  materials;
  std::vector<FeElement> elements;       /* of this rank; each element is on one rank */

  explicit FeModel(MPI_Comm comm);
  ~FeModel();
  FeModel(const FeModel &)            = delete;
  FeModel &operator=(const FeModel &) = delete;

  /* A Gmsh mesh (.msh) of tetrahedra with 4 or 10 nodes or bricks with 8 or 20; materials by the name of physical volumes, "" for
     all others. Physical groups of any dimension become node sets with the group's name or number; where groups of several dimensions
     share a name, their sets are "point rod", "curve rod", "surface rod", "volume rod". METIS divides the mesh among the ranks. */
  PetscErrorCode readMesh(const std::string &file, const std::map<std::string, Material> &materials);
  /* Stored matrices of CalculiX: stem.sti, stem.mas, stem.dof, nodes and sets of the input deck stem.inp */
  PetscErrorCode readCalculix(const std::string &stem);
  /* Matrix Market or PETSc binary files of K and M without supports, with three unknowns per node. File of nodes: lines "label x y z"; file
     of sets: lines "name label label ...". Empty file names: no nodes or no sets are known */
  PetscErrorCode readMatrices(const std::string &stiffness, const std::string &mass, const std::string &nodes, const std::string &sets);
  /* Matrices in memory (referenced, with both triangles), coordinates of own nodes, three per node */
  PetscErrorCode setMatrices(Mat stiffness, Mat mass, const std::vector<double> &coordinates);

  PetscErrorCode addSet(const std::string &name, const std::vector<PetscInt> &own_nodes);
  PetscErrorCode view(PetscViewer viewer) const;
};

/* ---- reduction ---- */

enum class Tie {
  Rigid,  /* the nodes follow the attachment point as a rigid body (RBE2) */
  Average /* the point follows the weighted mean motion of the nodes (RBE3) */
};

struct Attachment {
  std::string name, set = {};      /* set: name of the node set; empty: the same as the attachment's */
  Tie         tie = Tie::Rigid;
  bool        at_given = false;    /* the attachment point is `position`; false: the centroid of the nodes */
  Vector3     position = Vector3::Zero();
  /* Tie::Average: a weight for each node of the set, ordered by increasing label (FeModel::label), which does not depend on the number of
     ranks; empty: equal weights */
  std::vector<double> weights = {};
};

enum class Method {
  CraigBampton, /* constraint modes and fixed-interface normal modes; without attachments FreeFree is used, and ReducedBody::method says so */
  FreeFree,     /* normal modes of the unsupported body; attachments follow them */
  Static        /* constraint modes only (Guyan) */
};

/* Forces on the FE model that the reduction keeps as a load case of the body, see ModalLoad in forces.h. A load case adds no static (residual)
   vector to the modes: deflections under it converge with the number of modes. If the static answer has to be exact, make an attachment of
   the loaded nodes (Tie::Average does not stiffen the body); keeping the nodes does not help. */
struct LoadCase {
  std::string name;
  /* Unit pressure, directed inwards, on the outer faces of elements whose nodes are all in this set; needs elements. If `follows`, the pressure
     remains normal to the deformed surface, to first order; otherwise its nodal forces are constant in body axes. */
  std::string surface = {};
  bool        follows = true;
  /* Or forces on nodes by label, three components each, in the axes of the FE model; the same on all ranks */
  std::vector<PetscInt> node  = {};
  std::vector<double>   force = {};
};

struct Reduction {
  std::vector<Attachment> attachments;
  Method   method = Method::CraigBampton;
  PetscInt modes  = 20;     /* largest number of normal modes; PETSC_DEFAULT: all below max_frequency */
  double   max_frequency = 0;      /* highest frequency of normal modes, cycles per unit of time; 0: no bound */
  double   keep_below    = 0;      /* modes of the reduced pair (K, M) below this frequency are kept; 0: all. If bounds leave no modes, a notice says so */
  std::vector<PetscInt> keep;      /* numbers (from 0) of the modes of the reduced pair that are kept; empty: all */
  bool     stiffening = false;     /* geometric stiffening by loads on attachments and by angular velocity; needs elements and an attachment */
  std::vector<std::string> node_sets; /* nodes of these sets are kept for markers, forces and contact */
  std::vector<PetscInt>    nodes;     /* further nodes to keep, by label; the same on all ranks */
  std::vector<LoadCase>    loads;
  bool     all_nodes = true;       /* the modes are kept at all nodes (for stress, pictures) */
  bool     progress  = false;      /* rank 0 prints the progress */
};

struct ReducedMode {
  double frequency; /* cycles per unit of time */
  /* eta, where eta^2 = r^T K^-1 r / omega^2 with r = K x - omega^2 M x, x^T M x = 1, in the full model with its ties. The full model has an
     eigenvalue l with |omega^2 - l| <= eta l (Krylov-Weinstein); for an isolated mode the difference is about eta^2 l (Temple-Kato), so
     that the frequency is too high by about eta^2 / 2 of its value. Negative: not known */
  double residual;
};

/* ---- stress ---- */

/* Six components xx, yy, zz, xy, yz, zx */
struct StressModes {
  std::vector<PetscInt> node;   /* own nodes with stress, ascending: indices (from 0) into the own nodes of the ReducedBody */
  Eigen::MatrixXd       values; /* 6 rows per node x modes */
};

struct HotSpot {
  PetscInt label;   /* of the node */
  Vector3  position;
  double   stress;  /* largest von Mises stress */
  double   time;    /* when it occurred */
};

/* ---- the reduced body ---- */

struct ReducedBody {
  ModalBody modal; /* input of a scene, the same on every rank */

  std::string source, method, units;   /* provenance */
  PetscInt    fe_nodes = 0;
  double      elastic_scale = 0;       /* largest elastic eigenvalue omega^2 that is kept */
  std::vector<ReducedMode> mode;

  /* distributed: rank r has nodes [first, first + own) */
  MPI_Comm              comm = MPI_COMM_SELF;
  PetscInt              own = 0, first = 0;
  std::vector<double>   coordinates;   /* 3 per own node, axes and origin of the FE model; empty: not kept */
  std::vector<PetscInt> label;
  Eigen::MatrixXd       shape;         /* 3 rows per own node x modes; empty: not kept */
  std::vector<FeElement> elements;
  StressModes           stress;        /* empty until AddStressModes() */

  /* HDF5 file; its layout is in src/flexible/file.h */
  PetscErrorCode save(const std::string &file) const;
  PetscErrorCode load(MPI_Comm comm, const std::string &file);
  PetscErrorCode view(PetscViewer viewer) const;
};

/* Reads only the part of the file that a scene needs; the result is the same on every rank */
PetscErrorCode LoadModalBody(MPI_Comm comm, const std::string &file, ModalBody *body);

PetscErrorCode Reduce(const FeModel &model, const Reduction &reduction, ReducedBody *body);

/* Stress modes at all nodes: stress at the elements' nodes, averaged over the elements of one material around a node */
PetscErrorCode AddStressModes(const FeModel &model, ReducedBody *body);

/* von Mises stress of all own nodes that have stress modes, for modal coordinates eta */
PetscErrorCode VonMises(const ReducedBody &body, const Eigen::VectorXd &eta, std::vector<double> *stress);

/* Follows the largest von Mises stress of every node through a run */
class HotSpots
{
public:
  explicit HotSpots(const ReducedBody &body);
  PetscErrorCode add(double time, const Eigen::VectorXd &eta);
  /* the `count` highest, no two nearer to each other than `distance`; on every rank. Collective */
  PetscErrorCode highest(PetscInt count, double distance, std::vector<HotSpot> *spots) const;

private:
  void follow() const; /* evaluates the states collected by add(): several at a time are faster */

  const ReducedBody          &body_;
  mutable std::vector<double> stress_, time_, when_;
  mutable Eigen::MatrixXd     state_; /* modal coordinates at the times when_ */
  mutable Eigen::Index        waiting_ = 0; /* number of states not yet evaluated */
};

/* Writes the displacement and, if there are stress modes, the stress for modal coordinates eta into a .vtu file for ParaView, in the axes of
   the FE model or, with `origin` and `axes` (origin of the FE model, its axes as columns), in space. Collective */
PetscErrorCode WriteField(const ReducedBody &body, const Eigen::VectorXd &eta, const std::string &file, const Vector3 &origin = Vector3::Zero(),
                          const Matrix3 &axes = Matrix3::Identity());

/* Surface of the mesh, triangulated by the corners of its elements, for Scene::surface() and the page; it is on rank 0, and empty on the
   others. It has stress if all of its nodes have stress modes. The body needs elements and modes at all nodes. Collective */
PetscErrorCode MakeSurface(const ReducedBody &body, Surface *surface);

/* ---- the whole model in a scene ---- */

enum class FeLaw {
  Small, /* forces K (x - X) about the position at the start: the body must not rotate much; rigid attachments rotate with the nodes to first order */
  Large  /* St. Venant-Kirchhoff material, total Lagrangian, for large displacements and rotations. Everything in K and M must be there as
            elements. These are fully integrated: elements with reduced integration in K, such as C3D20R, become some per cent stiffer */
};

struct FullBody {
  FeLaw   law              = FeLaw::Large;
  Vector3 position         = Vector3::Zero();     /* of the origin of the FE model at the start, undeformed, space axes */
  Matrix3 rotation         = Matrix3::Identity(); /* axes of the FE model as columns */
  Vector3                 velocity         = Vector3::Zero();     /* of the FE model's origin (FlexibleBody: of the centre of mass), space axes */
  Vector3 angular_velocity = Vector3::Zero();     /* space axes */
  double  mass_damping = 0, stiffness_damping = 0; /* C = a M + b K; with FeLaw::Large b must be 0 */
  std::vector<Attachment> attachments;
};

/*
  The FE model itself as a body with 3 coordinates per node, distributed as the model is. Attachments are massless frames for joints, forces
  and markers; a rigid tie costs three multipliers per node, an average six for all its nodes. The model must outlive the scene. add() is
  collective: call it on all ranks in the same order as the other calls that describe the scene. A page of the run (-scene_page) shows the
  surface of the mesh, coloured by stress if elements have materials. With FeLaw::Large, model.K and model.M are not used after add():
  MatDestroy() frees 1.9 kB per unknown. Keep them if the scene will be described anew (parameters, another start) or the model is added to
  another scene.
*/
class FullFeBody
{
public:
  PetscErrorCode add(Scene &scene, const std::string &name, const FeModel &model, const FullBody &body);
  Body           attachment(const std::string &name) const; /* Body{} if there is none; the scene reports its use as an error, by name */

  /* Positions of own nodes in a run of scene.createTS(), in space axes, 3 per node: at time t within the last step; before the first step at
     the start, after StaticEquilibrium() in equilibrium */
  PetscErrorCode positions(TS ts, PetscReal t, std::vector<double> *x) const;
  /* Writes displacements (from the undeformed body at the start) into a .vtu file. Collective */
  PetscErrorCode writeField(TS ts, PetscReal t, const std::string &file) const;

private:
  std::string                 name_;
  PetscInt                    scene_ = 0, extension_ = -1; /* number of the scene, and of this body among its whole FE bodies */
  std::weak_ptr<Model>        model_;                      /* of the scene, for messages */
  std::map<std::string, Body> frames_;
};

} // namespace hhtdae

#endif
