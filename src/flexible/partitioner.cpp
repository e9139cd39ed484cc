/*
  METIS as a type of PetscPartitioner, because PETSc offers ParMETIS at best. METIS is
  serial: the first rank gathers the graph of cells, a few integers per cell; coordinates and elements stay
  distributed.
*/
#include "flexible/partitioner.h"
#include "flexible/exchange.h"
#include <algorithm>
#include <metis.h>
#include <petsc/private/partitionerimpl.h>

namespace hhtdae
{

namespace
{

PetscErrorCode CallMetis(std::vector<idx_t> &xadj, std::vector<idx_t> &adjacent, PetscInt nparts,
                         std::vector<PetscMPIInt> &part)
{
  idx_t vertices = (idx_t)xadj.size() - 1, balances = 1, parts = (idx_t)nparts, cut = 0;
  PetscFunctionBegin;
  part.assign(vertices, 0);
  if (nparts == 1 || vertices == 0) PetscFunctionReturn(0);
  if (vertices <= nparts) { /* METIS is not meant for parts of less than one vertex */
    for (idx_t v = 0; v < vertices; v++) part[v] = (PetscMPIInt)v;
    PetscFunctionReturn(0);
  }
  std::vector<idx_t> out(vertices);
  idx_t              options[METIS_NOPTIONS];
  METIS_SetDefaultOptions(options);
  options[METIS_OPTION_SEED] = 1; /* the same parts in every run */
  const int error = METIS_PartGraphKway(&vertices, &balances, xadj.data(), adjacent.data(), nullptr, nullptr, nullptr,
                                        &parts, nullptr, nullptr, options, &cut, out.data());
  PetscCheck(error == METIS_OK, PETSC_COMM_SELF, PETSC_ERR_LIB,
             "METIS could not divide %lld cells among %lld ranks: error %d", (long long)vertices, (long long)nparts,
             error);
  std::copy(out.begin(), out.end(), part.begin());
  PetscCall(PetscInfo(nullptr, "mesh: METIS divided %lld cells among %lld ranks, cutting %lld faces\n",
                      (long long)vertices, (long long)nparts, (long long)cut));
  PetscFunctionReturn(0);
}

/* Gathers the graph on the first rank, divides it there and returns the parts. METIS' integers may differ from PETSc's. */
PetscErrorCode Divide(MPI_Comm comm, PetscInt nparts, PetscInt vertices, const PetscInt start[],
                      const PetscInt adjacent[], std::vector<PetscMPIInt> &part)
{
  const PetscInt           first = vertices ? start[0] : 0, edges = vertices ? start[vertices] - first : 0;
  std::vector<PetscInt>    degree(vertices);
  std::vector<PetscInt>    degrees, neighbours;
  std::vector<std::size_t> cells_of, edges_of;
  std::vector<PetscMPIInt> parts;
  PetscMPIInt              rank;
  PetscErrorCode           failed = 0;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  for (PetscInt v = 0; v < vertices; v++) degree[v] = start[v + 1] - start[v];
  PetscCall(GatherTo0(comm, degree.data(), vertices, &degrees, &cells_of));
  PetscCall(GatherTo0(comm, adjacent + first, edges, &neighbours, &edges_of));
  if (rank == 0) {
    std::vector<idx_t> xadj(degrees.size() + 1, 0), adjncy(neighbours.begin(), neighbours.end());
    for (std::size_t v = 0; v < degrees.size(); v++) xadj[v + 1] = xadj[v] + (idx_t)degrees[v];
    failed = CallMetis(xadj, adjncy, nparts, parts);
  }
  PetscCallMPI(MPI_Bcast(&failed, 1, MPI_INT, 0, comm));
  PetscCheck(!failed, comm, PETSC_ERR_LIB,
             "METIS could not divide the mesh among %d ranks; -petscpartitioner_type simple does without it",
             (int)nparts);
  PetscCall(ScatterFrom0(comm, parts, cells_of, vertices, &part));
  PetscFunctionReturn(0);
}

/* Returns the local vertices, sorted by part, as a section and an IS */
PetscErrorCode PutParts(PetscInt nparts, const std::vector<PetscMPIInt> &part, PetscSection section, IS *partition)
{
  const PetscInt vertices = (PetscInt)part.size();
  PetscInt      *order;
  PetscFunctionBegin;
  std::vector<PetscInt> offset(nparts + 1, 0);
  for (PetscMPIInt p : part) offset[p + 1]++;
  PetscCall(PetscSectionSetChart(section, 0, nparts));
  for (PetscInt p = 0; p < nparts; p++) PetscCall(PetscSectionSetDof(section, p, offset[p + 1]));
  PetscCall(PetscSectionSetUp(section));
  for (PetscInt p = 0; p < nparts; p++) offset[p + 1] += offset[p];
  PetscCall(PetscMalloc1(vertices, &order));
  for (PetscInt v = 0; v < vertices; v++) order[offset[part[v]]++] = v;
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, vertices, order, PETSC_OWN_POINTER, partition));
  PetscFunctionReturn(0);
}

#if PETSC_VERSION_LT(3, 21, 0)
PetscErrorCode Partition(PetscPartitioner p, PetscInt nparts, PetscInt vertices, PetscInt start[], PetscInt adjacent[],
                         PetscSection, PetscSection, PetscSection section, IS *partition)
#else
PetscErrorCode Partition(PetscPartitioner p, PetscInt nparts, PetscInt vertices, PetscInt start[], PetscInt adjacent[],
                         PetscSection, PetscSection, PetscSection, PetscSection section, IS *partition)
#endif
{
  std::vector<PetscMPIInt> part;
  PetscFunctionBegin;
  PetscCall(Divide(PetscObjectComm((PetscObject)p), nparts, vertices, start, adjacent, part));
  PetscCall(PutParts(nparts, part, section, partition));
  PetscFunctionReturn(0);
}

PetscErrorCode View(PetscPartitioner, PetscViewer viewer)
{
  PetscBool ascii;
  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (ascii)
    PetscCall(PetscViewerASCIIPrintf(viewer, "METIS k-way on the graph of cells, gathered on the first rank\n"));
  PetscFunctionReturn(0);
}

PetscErrorCode Create(PetscPartitioner p)
{
  PetscFunctionBegin;
  p->noGraph        = PETSC_FALSE;
  p->ops->view      = View;
  p->ops->partition = Partition;
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode RegisterMetisPartitioner()
{
  static bool registered = false; /* PETSc's list of types exists as long as the process */
  PetscFunctionBegin;
  if (!registered) PetscCall(PetscPartitionerRegister(PETSCPARTITIONERMETISHHTDAE, Create));
  registered = true;
  PetscFunctionReturn(0);
}

PetscErrorCode PartitionCells(MPI_Comm comm, std::vector<PetscInt> &start, std::vector<PetscInt> &adjacent,
                              std::vector<PetscInt> *rank)
{
  const PetscInt   cells = (PetscInt)start.size() - 1;
  PetscPartitioner partitioner;
  PetscSection     section;
  IS               partition;
  PetscMPIInt      size;
  const PetscInt  *cell;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  rank->assign(cells, 0);
  if (size == 1) PetscFunctionReturn(0);
  PetscCall(RegisterMetisPartitioner());
  PetscCall(PetscPartitionerCreate(comm, &partitioner));
  PetscCall(PetscPartitionerSetType(partitioner, PETSCPARTITIONERMETISHHTDAE));
  PetscCall(PetscPartitionerSetFromOptions(partitioner));
  PetscCall(PetscPartitionerSetUp(partitioner));
  PetscCall(PetscSectionCreate(comm, &section));
  adjacent.reserve(1); /* a valid address for a graph without edges */
#if PETSC_VERSION_LT(3, 21, 0)
  PetscCall(PetscPartitionerPartition(partitioner, size, cells, start.data(), adjacent.data(), nullptr, nullptr,
                                      section, &partition));
#else
  PetscCall(PetscPartitionerPartition(partitioner, size, cells, start.data(), adjacent.data(), nullptr, nullptr,
                                      nullptr, section, &partition));
#endif
  PetscCall(ISGetIndices(partition, &cell));
  for (PetscMPIInt r = 0; r < size; r++) {
    PetscInt count, offset;
    PetscCall(PetscSectionGetDof(section, r, &count));
    PetscCall(PetscSectionGetOffset(section, r, &offset));
    for (PetscInt k = 0; k < count; k++) (*rank)[cell[offset + k]] = r;
  }
  PetscCall(ISRestoreIndices(partition, &cell));
  PetscCall(ISDestroy(&partition));
  PetscCall(PetscSectionDestroy(&section));
  PetscCall(PetscPartitionerDestroy(&partitioner));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
