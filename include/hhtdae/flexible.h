/*
  Flexible bodies from linear finite-element models: stiffness and mass matrices with nodes and elements, from a mesh, from another
  FE program or from memory; Craig-Bampton reduction through SLEPc to a body in modal coordinates; its file; stress recovery.

    FeModel model(PETSC_COMM_WORLD);
    PetscCall(model.readMesh("frame.msh", {{"steel", Material{2.1e11, 0.3, 7850}}}));
    Reduction reduction;
    reduction.attachments = {{"hub", "hub nodes"}, {"tip", "tip nodes", Tie::Average}};
    reduction.modes       = 20;
    ReducedBody body;
    PetscCall(Reduce(model, reduction, &body));
    PetscCall(body.save("frame.h5"));

  Units are the user's own, but consistent. All functions that return PetscErrorCode are collective on the model's communicator.
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

/* Nodes in the order of Gmsh: corners, then middles of edges */
struct FeElement {
  ElementType  type;
  PetscInt     material; /* among FeModel::materials */
  PetscInt     node[20]; /* global numbers of nodes */
};

/*
  Three translations per node; rank r has nodes [first, first + own). K and M have the rows 3 n .. 3 n + 2 of node n; both are
  symmetric AIJ matrices with both triangles, K free of supports. Elements are needed for stress, pictures, pressure (LoadCase::surface), stiffening
  (Reduction::stiffening) and FeLaw::Large, which reads nothing but them; all else comes from K and M.
*/
struct FeModel {
  MPI_Comm    comm;
  std::string source;                    /* file or program it came from */
  PetscInt    nodes = 0, own = 0, first = 0;
  std::vector<double>   coordinates;     /* 3 per own node */
  std::vector<PetscInt> label;           /* of own nodes: their numbers in the mesh or the other program */
  Mat         K = nullptr, M = nullptr;
  std::map<std::string, std::vector<PetscInt>> sets; /* own nodes of a named set, by global number, sorted; the same names on all ranks */
  std::vector<Material>  materials;
  std::vector<FeElement> elements;       /* of this rank; each element is on one rank */

  explicit FeModel(MPI_Comm comm);
  ~FeModel();
  FeModel(const FeModel &)            = delete;
  FeModel &operator=(const FeModel &) = delete;

  /* A Gmsh mesh (.msh) of tetrahedra with 4 or 10 nodes or bricks with 8 or 20; materials by the name of physical volumes, "" for
     all others; physical groups of any dimension become node sets by their names, or numbers; groups of several
     dimensions that share one are "point rod", "curve rod", "surface rod", "volume rod". METIS divides the mesh among the ranks. */
  PetscErrorCode readMesh(const std::string &file, const std::map<std::string, Material> &materials);
  /* Stored matrices of CalculiX: stem.sti, stem.mas, stem.dof, nodes and sets of the input deck stem.inp */
  PetscErrorCode readCalculix(const std::string &stem);
  /* Matrix Market files, or PETSc binary, of K and M, without their supports; nodes: "label x y z" a line, three unknowns a node;
     sets: lines "name label label ...". Empty names: no nodes or no sets are known */
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
  std::string name, set = {};      /* set of nodes; its name is the attachment's if empty */
  Tie         tie = Tie::Rigid;
  bool        at_given = false;    /* else at the centroid of the nodes */
  Vector3     position = Vector3::Zero();
  /* of an average: one for each node of the set, in the ascending order of the nodes' labels, FeModel::label, which is the same on any number of ranks; empty: equal */
  std::vector<double> weights = {};
};

enum class Method {
  CraigBampton, /* constraint modes and fixed-interface normal modes; without attachments FreeFree, as ReducedBody::method then says */
  FreeFree,     /* normal modes of the unsupported body; attachments follow them */
  Static        /* constraint modes alone (Guyan) */
};

/* Forces on the FE model that the reduction keeps as a load case of the body, see ModalLoad of forces.h. A load case brings no static (residual) vector into
   the modes: deflections under it converge with their number. Where the static answer has to be exact, make an attachment of the loaded nodes (Tie::Average
   stiffens nothing); kept nodes alone do not help. */
struct LoadCase {
  std::string name;
  /* Pressure one, which pushes inwards, on the outer faces of elements whose nodes are all in this set; needs elements. If it follows, it stays normal
     to the deformed surface, to first order; else its forces stay as they are in the axes of the body. */
  std::string surface = {};
  bool        follows = true;
  /* or forces on nodes by label, three components each, in the axes of the FE model; the same on all ranks */
  std::vector<PetscInt> node  = {};
  std::vector<double>   force = {};
};

struct Reduction {
  std::vector<Attachment> attachments;
  Method   method = Method::CraigBampton;
  PetscInt modes  = 20;     /* normal modes, at most; PETSC_DEFAULT with max_frequency: all below it */
  double   max_frequency = 0;      /* of normal modes, cycles per unit of time; 0: no bound */
  double   keep_below    = 0;      /* modes of the reduced pair that are kept; 0: all */
  std::vector<PetscInt> keep;      /* modes of the reduced pair, by number from 0; empty: all */
  bool     stiffening = false;     /* geometric stiffening by loads on attachments and by angular velocity; needs elements and an attachment */
  std::vector<std::string> node_sets; /* nodes of these sets are kept for markers, forces and contact */
  std::vector<PetscInt>    nodes;     /* and these, by label; the same on all ranks */
  std::vector<LoadCase>    loads;
  bool     all_nodes = true;       /* the modes at all nodes are kept (for stress, pictures) */
  bool     progress  = false;      /* printed by rank 0 */
};

struct ReducedMode {
  double frequency; /* cycles per unit of time */
  /* eta, eta^2 = r^T K^-1 r / omega^2 with r = K x - omega^2 M x, x^T M x = 1, in the full model as it is tied: it has an
     eigenvalue l with |omega^2 - l| <= eta l (Krylov-Weinstein), and for an isolated mode the difference is about eta^2 l
     (Temple-Kato), so that the frequency is about eta^2 / 2 too high. Negative: not known */
  double residual;
};

/* ---- stress ---- */

/* Six components xx, yy, zz, xy, yz, zx */
struct StressModes {
  std::vector<PetscInt> node;   /* own, ascending, by place from 0 among the ReducedBody's own nodes */
  Eigen::MatrixXd       values; /* 6 rows per node x modes */
};

struct HotSpot {
  PetscInt label;   /* of the node */
  Vector3  position;
  double   stress;  /* largest von Mises */
  double   time;
};

/* ---- the reduced body ---- */

struct ReducedBody {
  ModalBody modal; /* the same on every rank: what a scene takes */

  std::string source, method, units;   /* provenance */
  PetscInt    fe_nodes = 0;
  double      elastic_scale = 0;       /* largest elastic eigenvalue kept */
  std::vector<ReducedMode> mode;

  /* distributed: rank r has nodes [first, first + own) */
  MPI_Comm              comm = MPI_COMM_SELF;
  PetscInt              own = 0, first = 0;
  std::vector<double>   coordinates;   /* 3 per own node, axes and origin of the FE model; empty: not kept */
  std::vector<PetscInt> label;
  Eigen::MatrixXd       shape;         /* 3 rows per own node x modes; empty: not kept */
  std::vector<FeElement> elements;
  StressModes           stress;        /* empty until asked for */

  /* A file in HDF5, see the layout in src/flexible/file.h */
  PetscErrorCode save(const std::string &file) const;
  PetscErrorCode load(MPI_Comm comm, const std::string &file);
  PetscErrorCode view(PetscViewer viewer) const;
};

/* Only what a scene takes of the file, the same on every rank */
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
  void follow() const; /* states that wait: several at a time are faster */

  const ReducedBody          &body_;
  mutable std::vector<double> stress_, time_, when_;
  mutable Eigen::MatrixXd     state_; /* modal coordinates at the times when_ */
  mutable Eigen::Index        waiting_ = 0;
};

/* Displacement and, where there are stress modes, stress at modal coordinates eta: a .vtu file for ParaView, in the axes of the FE
   model or moved by the pose (origin of the FE model, axes as columns). Collective */
PetscErrorCode WriteField(const ReducedBody &body, const Eigen::VectorXd &eta, const std::string &file, const Vector3 &origin = Vector3::Zero(),
                          const Matrix3 &axes = Matrix3::Identity());

/* The surface of the mesh between the corners of its elements, for Scene::surface() and the page: on the first rank, empty on the others. With stress
   if all of its nodes have stress modes. The body needs elements and modes at its nodes. Collective */
PetscErrorCode MakeSurface(const ReducedBody &body, Surface *surface);

/* ---- the whole model in a scene ---- */

enum class FeLaw {
  Small, /* K (x - X) about the position at the start, which must not turn away from it much; rigid attachments turn with the nodes to first order */
  Large  /* St. Venant-Kirchhoff material, total Lagrangian: displacements and rotations at large. All that is in K and M has to be there as elements,
            which are integrated in full: those of reduced integration, as C3D20R, become some per cent stiffer than in K */
};

struct FullBody {
  FeLaw   law              = FeLaw::Large;
  Vector3 position         = Vector3::Zero();     /* of the origin of the FE model at the start, undeformed, space axes */
  Matrix3 rotation         = Matrix3::Identity(); /* axes of the FE model as columns */
  Vector3                 velocity         = Vector3::Zero();     /* of the origin of the FE model, space axes; of a FlexibleBody it is that of the centre of mass */
  Vector3 angular_velocity = Vector3::Zero();     /* space axes */
  double  mass_damping = 0, stiffness_damping = 0; /* C = a M + b K; with FeLaw::Large b must be 0 */
  std::vector<Attachment> attachments;
};

/*
  The FE model itself as a body, 3 coordinates a node, distributed as the model is. Attachments are frames without mass for joints,
  forces and markers; each node tied rigidly costs three multipliers, an average six for all its nodes. The model must outlive the
  scene. Collective; call it on all ranks in the same order as the scene's other parts. A page of the run (-scene_page) shows the surface of its
  mesh, coloured by stress where elements have materials. With FeLaw::Large model.K and model.M are not read after add(): MatDestroy() gives
  1.9 kB an unknown back, unless the scene is described anew later (parameters, another start) or the model put into another one.
*/
class FullFeBody
{
public:
  PetscErrorCode add(Scene &scene, const std::string &name, const FeModel &model, const FullBody &body);
  Body           attachment(const std::string &name) const; /* Body{} if there is none, which the scene will refuse by name */

  /* positions of own nodes at time t within the last step, or where the run stands: before the first step at the start, after StaticEquilibrium() in
     equilibrium; after scene.createTS(); space axes, 3 per node */
  PetscErrorCode positions(TS ts, PetscReal t, std::vector<double> *x) const;
  /* displacements (from the undeformed body at the start) as a .vtu file. Collective */
  PetscErrorCode writeField(TS ts, PetscReal t, const std::string &file) const;

private:
  std::string                 name_;
  PetscInt                    scene_ = 0, extension_ = -1; /* numbers of the scene, and of the body among those of its kind */
  std::weak_ptr<Model>        model_;                      /* the scene's, for messages */
  std::map<std::string, Body> frames_;
};

} // namespace hhtdae

#endif
