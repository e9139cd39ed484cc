/* Assembly of K and M: first the pattern of blocks, for exact preallocation, then the elements. */
#include "flexible/assembly.h"
#include "flexible/element.h"
#include "flexible/exchange.h"
#include <algorithm>

namespace hhtdae
{

ElementNodes::~ElementNodes() { PetscCallAbort(PETSC_COMM_SELF, PetscSFDestroy(&sf)); }

PetscInt ElementNodes::place(PetscInt number) const
{
  return (PetscInt)(std::lower_bound(global.begin(), global.end(), number) - global.begin());
}

PetscErrorCode ElementNodes::setUp(const FeModel &model, const std::vector<FeElement> &elements)
{
  PetscLayout layout;
  PetscFunctionBegin;
  global.clear();
  for (const FeElement &e : elements) global.insert(global.end(), e.node, e.node + FeNodes(e.type));
  std::sort(global.begin(), global.end());
  global.erase(std::unique(global.begin(), global.end()), global.end());
  global.reserve(1);
  PetscCall(PetscLayoutCreate(model.comm, &layout));
  PetscCall(PetscLayoutSetLocalSize(layout, model.own));
  PetscCall(PetscLayoutSetUp(layout));
  PetscCall(PetscSFCreate(model.comm, &sf));
  PetscCall(PetscSFSetGraphLayout(sf, layout, (PetscInt)global.size(), nullptr, PETSC_COPY_VALUES, global.data()));
  PetscCall(PetscSFSetUp(sf));
  PetscCall(PetscLayoutDestroy(&layout));
  PetscFunctionReturn(0);
}

/* MPI type of `width` reals per node; PETSc cannot sum a contiguous type of one real, so that width 1 is MPIU_REAL itself */
static PetscErrorCode VectorType(int width, MPI_Datatype *type)
{
  PetscFunctionBegin;
  *type = MPIU_REAL;
  if (width == 1) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Type_contiguous(width, MPIU_REAL, type));
  PetscCallMPI(MPI_Type_commit(type));
  PetscFunctionReturn(0);
}

PetscErrorCode ElementNodes::bring(int width, const double *own, double *here) const
{
  MPI_Datatype type;
  PetscFunctionBegin;
  PetscCall(VectorType(width, &type));
  PetscCall(PetscSFBcastBegin(sf, type, own, here, MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(sf, type, own, here, MPI_REPLACE));
  if (width > 1) PetscCallMPI(MPI_Type_free(&type));
  PetscFunctionReturn(0);
}

PetscErrorCode ElementNodes::add(int width, const double *here, double *own) const
{
  MPI_Datatype type;
  PetscFunctionBegin;
  PetscCall(VectorType(width, &type));
  PetscCall(PetscSFReduceBegin(sf, type, here, own, MPI_SUM));
  PetscCall(PetscSFReduceEnd(sf, type, here, own, MPI_SUM));
  if (width > 1) PetscCallMPI(MPI_Type_free(&type));
  PetscFunctionReturn(0);
}

namespace
{

/* ---- pattern ---- */

/* The elements of this rank at each of its nodes: those of node n are element[start[n]] to element[start[n + 1] - 1] */
struct NodeElements {
  std::vector<PetscInt> start, element;
};

NodeElements ElementsAround(const FeModel &model, const ElementNodes &nodes)
{
  NodeElements a;
  a.start.assign(nodes.global.size() + 1, 0);
  for (const FeElement &e : model.elements)
    for (int i = 0; i < FeNodes(e.type); i++) a.start[nodes.place(e.node[i]) + 1]++;
  for (std::size_t n = 0; n < nodes.global.size(); n++) a.start[n + 1] += a.start[n];
  a.element.resize(a.start.back());
  std::vector<PetscInt> next(a.start.begin(), a.start.end() - 1);
  for (std::size_t k = 0; k < model.elements.size(); k++)
    for (int i = 0; i < FeNodes(model.elements[k].type); i++)
      a.element[next[nodes.place(model.elements[k].node[i])]++] = (PetscInt)k;
  return a;
}

/* Nodes that share an element of this rank with node n, sorted */
void Neighbours(const FeModel &model, const NodeElements &node_elements, std::size_t n, std::vector<PetscInt> *list)
{
  list->clear();
  for (PetscInt k = node_elements.start[n]; k < node_elements.start[n + 1]; k++) {
    const FeElement &e = model.elements[node_elements.element[k]];
    list->insert(list->end(), e.node, e.node + FeNodes(e.type));
  }
  std::sort(list->begin(), list->end());
  list->erase(std::unique(list->begin(), list->end()), list->end());
}

struct NodePair {
  PetscInt row, column;
  bool     operator<(const NodePair &o) const { return row != o.row ? row < o.row : column < o.column; }
};

/* Number of neighbours of each own node, itself included, among own nodes and among nodes of other ranks: blocks in its rows of K */
PetscErrorCode CountBlocks(const FeModel &model, const ElementNodes &nodes, std::vector<PetscInt> *own,
                           std::vector<PetscInt> *others)
{
  PetscMPIInt              size;
  const PetscInt           first = model.first, last = model.first + model.own;
  std::vector<PetscInt>    firsts, list;
  std::vector<NodePair>    from_others;
  std::vector<std::size_t> unused;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(model.comm, &size));
  PetscCall(GatherAll(model.comm, std::vector<PetscInt>{last}, &firsts)); /* ends of the ranks' nodes */
  const NodeElements                 node_elements = ElementsAround(model, nodes);
  std::vector<std::vector<NodePair>> out(size);
  for (std::size_t n = 0; n < nodes.global.size(); n++) {
    const PetscInt row = nodes.global[n];
    if (row >= first && row < last) continue;
    Neighbours(model, node_elements, n, &list);
    std::vector<NodePair> &to = out[std::upper_bound(firsts.begin(), firsts.end(), row) - firsts.begin()];
    for (PetscInt column : list) to.push_back({row, column});
  }
  PetscCall(Exchange(model.comm, out, &from_others, &unused));
  std::sort(from_others.begin(), from_others.end());

  own->assign(model.own, 0);
  others->assign(model.own, 0);
  auto extra = from_others.begin();
  for (PetscInt k = 0; k < model.own; k++) {
    const PetscInt    row = first + k;
    const std::size_t n   = nodes.place(row);
    list.clear();
    if (n < nodes.global.size() && nodes.global[n] == row) Neighbours(model, node_elements, n, &list);
    for (; extra != from_others.end() && extra->row == row; ++extra) list.push_back(extra->column);
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    for (PetscInt column : list) (column >= first && column < last ? *own : *others)[k]++;
  }
  PetscFunctionReturn(0);
}

/* A matrix whose rows have `dense` entries in each block: 3 in K, 1 in M */
PetscErrorCode CreateMatrix(const FeModel &model, const std::vector<PetscInt> &own, const std::vector<PetscInt> &others,
                            PetscInt dense, Mat *A)
{
  std::vector<PetscInt> diagonal(3 * model.own + 1), off(3 * model.own + 1);
  PetscFunctionBegin;
  for (PetscInt i = 0; i < 3 * model.own; i++) {
    diagonal[i] = dense * own[i / 3];
    off[i]      = dense * others[i / 3];
  }
  PetscCall(MatCreate(model.comm, A));
  PetscCall(MatSetSizes(*A, 3 * model.own, 3 * model.own, 3 * model.nodes, 3 * model.nodes));
  PetscCall(MatSetBlockSize(*A, 3));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*A, 0, diagonal.data()));
  PetscCall(MatMPIAIJSetPreallocation(*A, 0, diagonal.data(), 0, off.data()));
  PetscCall(MatSetOption(*A, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_TRUE));
  PetscCall(MatSetOption(*A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(*A, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
  PetscFunctionReturn(0);
}

/* ---- entries ---- */

template <class Shape>
PetscErrorCode AddElement(const FeModel &model, const FeElement &e, const fe::NodeVectors<Shape> &X,
                          bool mass_as_stiffness, double *least)
{
  constexpr int        n        = Shape::nodes;
  const Material      &material = model.materials[e.material];
  fe::Stiffness<Shape> K;
  fe::Mass<Shape>      m;
  PetscInt             row[n];
  PetscFunctionBegin;
  *least = fe::ElementStiffness<Shape>(X, fe::Lame(material), K);
  fe::Lower(*least, fe::ElementMass<Shape>(X, material.density, m, mass_as_stiffness ? fe::MassPoints::Stiffness : fe::MassPoints::Own));
  if (!(*least > fe::degenerate)) PetscFunctionReturn(0);
  /* both matrices are symmetric, so that storage by columns or rows makes no difference */
  PetscCall(MatSetValuesBlocked(model.K, n, e.node, n, e.node, K.data(), ADD_VALUES));
  for (int d = 0; d < 3; d++) {
    for (int i = 0; i < n; i++) row[i] = 3 * e.node[i] + d;
    PetscCall(MatSetValues(model.M, n, row, n, row, m.data(), ADD_VALUES));
  }
  PetscFunctionReturn(0);
}

std::string DegenerateElement(const FeElement &e, PetscInt tag, double least)
{
  char text[512];
  std::snprintf(text, sizeof text,
                "element %lld (%s) %s: the determinant of its Jacobian is %g of its extent cubed at the worst point; "
                "repair the mesh%s",
                (long long)tag, fe::ShapeName(e.type), least < 0 ? "is turned inside out" : "has no volume", least,
                e.type == ElementType::Tetrahedron10 || e.type == ElementType::Brick20
                    ? " (gmsh -optimize_ho straightens curved elements)"
                    : "");
  return text;
}

PetscErrorCode AddElements(FeModel *model, const ElementNodes &nodes, const std::vector<double> &X,
                           const std::vector<PetscInt> &tags)
{
  PetscBool   as_stiffness = PETSC_FALSE;
  char        points[32]   = "exact";
  std::string problem;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-fe_mass_points", points, sizeof points, nullptr));
  PetscCall(PetscStrcmp(points, "stiffness", &as_stiffness));
  PetscCheck(as_stiffness || std::string(points) == "exact", model->comm, PETSC_ERR_ARG_WRONG,
             "-fe_mass_points %s: exact or stiffness", points);
  for (std::size_t k = 0; k < model->elements.size() && problem.empty(); k++) {
    const FeElement &e     = model->elements[k];
    double           least = 0;
    PetscCall(fe::WithShape(e.type, [&](auto shape) -> PetscErrorCode {
      using Shape = decltype(shape);
      fe::NodeVectors<Shape> x;
      for (int i = 0; i < Shape::nodes; i++)
        x.col(i) = Eigen::Map<const Eigen::Vector3d>(&X[3 * nodes.place(e.node[i])]);
      return AddElement<Shape>(*model, e, x, as_stiffness, &least);
    }));
    if (!(least > fe::degenerate)) problem = "mesh " + model->source + ": " + DegenerateElement(e, k < tags.size() ? tags[k] : (PetscInt)k, least);
  }
  PetscCall(Agree(model->comm, problem, PETSC_ERR_ARG_WRONG));
  PetscFunctionReturn(0);
}

/* Attaches the rigid-body motions to K, for multigrid */
PetscErrorCode AttachNearNullSpace(FeModel *model)
{
  Vec          coordinates;
  PetscScalar *x;
  MatNullSpace rigid;
  PetscFunctionBegin;
  PetscCall(MatCreateVecs(model->K, &coordinates, nullptr));
  PetscCall(VecSetBlockSize(coordinates, 3));
  PetscCall(VecGetArray(coordinates, &x));
  std::copy(model->coordinates.begin(), model->coordinates.end(), x);
  PetscCall(VecRestoreArray(coordinates, &x));
  PetscCall(MatNullSpaceCreateRigidBody(coordinates, &rigid));
  PetscCall(MatSetNearNullSpace(model->K, rigid));
  PetscCall(MatNullSpaceDestroy(&rigid));
  PetscCall(VecDestroy(&coordinates));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode AssembleElements(FeModel *model, const std::vector<PetscInt> &tags)
{
  ElementNodes          nodes;
  std::vector<PetscInt> own, others;
  PetscFunctionBegin;
  PetscCall(nodes.setUp(*model));
  std::vector<double> X(3 * nodes.global.size() + 1);
  PetscCall(nodes.bring(3, model->coordinates.data(), X.data()));
  PetscCall(CountBlocks(*model, nodes, &own, &others));
  PetscCall(MatDestroy(&model->K));
  PetscCall(MatDestroy(&model->M));
  PetscCall(CreateMatrix(*model, own, others, 3, &model->K));
  PetscCall(CreateMatrix(*model, own, others, 1, &model->M));
  PetscCall(AddElements(model, nodes, X, tags));
  for (Mat A : {model->K, model->M}) PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  for (Mat A : {model->K, model->M}) PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatSetOption(model->M, MAT_SPD, PETSC_TRUE));
  PetscCall(AttachNearNullSpace(model));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
