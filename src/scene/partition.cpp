/* Distributes bodies to ranks by METIS. Vertices of the graph are bodies, weighted by their unknowns; edges are weighted
   by the joints and forces between two bodies. */
#include "model.h"
#include <algorithm>
#include <metis.h>

namespace hhtdae
{

namespace
{

struct Edge {
  PetscInt a, b, weight;
};

/* The body of a marker; for the frame of an attachment its flexible body, with which it stays on one rank */
PetscInt BodyOf(const SceneData &s, PetscInt marker)
{
  const PetscInt b = s.markers[marker].body;
  return b >= 0 && s.bodies[b].carrier >= 0 ? s.bodies[b].carrier : b;
}

/* Edges between the first body of each instance and its other bodies; edges among the others are not needed to keep the bodies together */
std::vector<Edge> Edges(const SceneData &s, const std::vector<PetscInt> &vertex)
{
  std::vector<Edge> edges;
  for (const StoreBase *store : s.order)
    for (PetscInt e = 0; e < store->size(); e++) {
      PetscInt first = -1;
      for (int k = 0; k < store->markers(); k++) {
        const PetscInt body = BodyOf(s, store->marker(e, k)), b = body < 0 ? -1 : vertex[body];
        if (b < 0) continue;
        if (first >= 0 && b != first) {
          edges.push_back({first, b, store->rows()});
          edges.push_back({b, first, store->rows()});
        }
        if (first < 0) first = b;
      }
    }
  std::sort(edges.begin(), edges.end(), [](const Edge &x, const Edge &y) { return x.a != y.a ? x.a < y.a : x.b < y.b; });
  std::size_t n = 0;
  for (const Edge &e : edges) {
    if (n && edges[n - 1].a == e.a && edges[n - 1].b == e.b) edges[n - 1].weight += e.weight;
    else edges[n++] = e;
  }
  edges.resize(n);
  return edges;
}

} // namespace

PetscErrorCode Partition(SceneData &s, PetscMPIInt size, std::vector<PetscMPIInt> &owner)
{
  std::vector<PetscInt> vertex(s.bodies.size(), -1), body; /* vertex: vertex of each body, or -1; body: body of each vertex */
  PetscMPIInt           rank;
  PetscFunctionBegin;
  owner.clear();
  if (size == 1) PetscFunctionReturn(0);
  for (std::size_t b = 0; b < s.bodies.size(); b++) {
    if (s.bodies[b].carrier >= 0) continue;
    vertex[b] = (PetscInt)body.size();
    body.push_back((PetscInt)b);
  }
  const std::size_t        n = body.size();
  std::vector<PetscMPIInt> of(n, 0);
  const auto               spread = [&] {
    owner.resize(s.bodies.size());
    for (std::size_t b = 0; b < owner.size(); b++) owner[b] = of[vertex[s.bodies[b].carrier >= 0 ? s.bodies[b].carrier : (PetscInt)b]];
  };
  PetscCallMPI(MPI_Comm_rank(s.comm, &rank));
  if (n <= (std::size_t)size) {
    for (std::size_t b = 0; b < n; b++) of[b] = (PetscMPIInt)b;
    spread();
    PetscFunctionReturn(0);
  }
  if (rank == 0) {
    const std::vector<Edge> edges = Edges(s, vertex);
    std::vector<idx_t>      xadj(n + 1, 0), adjacent(edges.size()), weight(edges.size()), size_of(n), part(n);
    idx_t                   vertices = (idx_t)n, balances = 1, parts = size, cut;
    for (std::size_t k = 0; k < edges.size(); k++) {
      xadj[edges[k].a + 1]++;
      adjacent[k] = (idx_t)edges[k].b;
      weight[k]   = (idx_t)edges[k].weight;
    }
    for (std::size_t b = 0; b < n; b++) {
      xadj[b + 1] += xadj[b];
      size_of[b] = (idx_t)CoordinatesOf(s, s.bodies[body[b]]);
    }
    idx_t options[METIS_NOPTIONS];
    METIS_SetDefaultOptions(options);
    options[METIS_OPTION_SEED] = 1; /* a fixed seed gives the same partition in every run */
    const int error = METIS_PartGraphKway(&vertices, &balances, xadj.data(), adjacent.data(), size_of.data(), nullptr, weight.data(), &parts,
                                          nullptr, nullptr, options, &cut, part.data());
    PetscCheck(error == METIS_OK, PETSC_COMM_SELF, PETSC_ERR_LIB, "METIS could not divide %zu bodies among %d ranks: error %d", n, size, error);
    for (std::size_t b = 0; b < n; b++) of[b] = (PetscMPIInt)part[b];
    PetscCall(PetscInfo(nullptr, "scene: METIS divided %zu bodies among %d ranks, cutting joints of %d rows\n", n, size, (int)cut));
  }
  PetscCallMPI(MPI_Bcast(of.data(), (PetscMPIInt)n, MPI_INT, 0, s.comm));
  spread();
  PetscFunctionReturn(0);
}

} // namespace hhtdae
