/* Displacements of selected nodes of a beam: the nodes nearest to the corner of the tip with the largest coordinates
   and to the middle of the edge with the largest y and z, and the mean over the tip */
#ifndef HHTDAE_BENCH_SOLIDBEAM_HISTORY_H
#define HHTDAE_BENCH_SOLIDBEAM_HISTORY_H

#include "flexible/full_body.h"
#include "scene/runtime.h"

#include <cmath>
#include <cstdio>

class History
{
public:
  /* If the name is empty nothing is written */
  PetscErrorCode open(const std::string &name, const hhtdae::FeModel &model, TS ts)
  {
    double low[3], high[3];
    PetscFunctionBeginUser;
    model_ = &model;
    PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank_));
    const hhtdae::Runtime *R = hhtdae::RunOf(ts);
    first_           = R->scene.extensions[0]->start[R->rank] - R->start;
    for (int k = 0; k < 3; k++) low[k] = PETSC_INFINITY, high[k] = PETSC_NINFINITY;
    for (std::size_t i = 0; i < model.coordinates.size(); i++) {
      low[i % 3]  = std::fmin(low[i % 3], model.coordinates[i]);
      high[i % 3] = std::fmax(high[i % 3], model.coordinates[i]);
    }
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, low, 3, MPI_DOUBLE, MPI_MIN, PETSC_COMM_WORLD));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, high, 3, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD));
    PetscCall(nearest(hhtdae::Vector3(high[0], high[1], high[2]), &node_[0]));
    PetscCall(nearest(hhtdae::Vector3((low[0] + high[0]) / 2, high[1], high[2]), &node_[1]));
    in_tip_ = (PetscInt)model.sets.at("tip").size();
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &in_tip_, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
    if (name.empty() || rank_ > 0) PetscFunctionReturn(0);
    out_ = std::fopen(name.c_str(), "w");
    PetscCheck(out_, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "cannot write %s", name.c_str());
    PetscFunctionReturn(0);
  }

  PetscErrorCode write(double t, Vec U)
  {
    const double *u;
    double        d[9] = {};
    PetscFunctionBeginUser;
    PetscCall(VecGetArrayRead(U, &u));
    for (int k = 0; k < 2; k++)
      if (node_[k] >= 0) add(u, node_[k], 1, d + 3 * k);
    for (PetscInt n : model_->sets.at("tip")) add(u, n - model_->first, 1. / (double)in_tip_, d + 6);
    PetscCall(VecRestoreArrayRead(U, &u));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, d, 9, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD));
    std::copy(d, d + 9, last_);
    if (!out_) PetscFunctionReturn(0);
    std::fprintf(out_, "%.15g", t);
    for (double x : d) std::fprintf(out_, " %.15e", x);
    std::fprintf(out_, "\n");
    PetscFunctionReturn(0);
  }

  PetscErrorCode close()
  {
    PetscFunctionBeginUser;
    if (!out_) PetscFunctionReturn(0);
    const bool good = !std::ferror(out_);
    PetscCheck(std::fclose(out_) == 0 && good, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "cannot write the history; is the folder full?");
    PetscFunctionReturn(0);
  }

  const double *last() const { return last_; } /* displacements at the end */

private:
  const hhtdae::FeModel *model_ = nullptr;
  PetscMPIInt    rank_  = 0;
  PetscInt       first_ = 0, node_[2] = {-1, -1}, in_tip_ = 0; /* node on this rank, or -1 */
  FILE          *out_   = nullptr;
  double         last_[9] = {};

  void add(const double *u, PetscInt node, double weight, double *d) const
  {
    for (int k = 0; k < 3; k++) d[k] += weight * (u[first_ + 3 * node + k] - model_->coordinates[3 * (std::size_t)node + (std::size_t)k]);
  }

  /* Among equally near nodes the one with the smallest label */
  PetscErrorCode nearest(const hhtdae::Vector3 &x, PetscInt *node) const
  {
    double   least = PETSC_INFINITY, all;
    PetscInt label = PETSC_MAX_INT, lowest, here = -1;
    PetscFunctionBeginUser;
    for (PetscInt n = 0; n < model_->own; n++) least = std::fmin(least, distance(x, n));
    PetscCallMPI(MPI_Allreduce(&least, &all, 1, MPI_DOUBLE, MPI_MIN, PETSC_COMM_WORLD));
    for (PetscInt n = 0; n < model_->own; n++)
      if (distance(x, n) <= all * (1 + 1e-9) + 1e-12 && model_->label[(std::size_t)n] < label) {
        here  = n;
        label = model_->label[(std::size_t)n];
      }
    PetscCallMPI(MPI_Allreduce(&label, &lowest, 1, MPIU_INT, MPI_MIN, PETSC_COMM_WORLD));
    *node = label == lowest ? here : -1;
    PetscFunctionReturn(0);
  }
  double distance(const hhtdae::Vector3 &x, PetscInt n) const { return (Eigen::Map<const hhtdae::Vector3>(&model_->coordinates[3 * (std::size_t)n]) - x).norm(); }
};

#endif
