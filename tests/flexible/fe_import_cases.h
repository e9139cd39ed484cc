/* Shared by the tests of imported matrices: dense matrices, their frequencies, files of a test */
#ifndef HHTDAE_TEST_FE_IMPORT_CASES_H
#define HHTDAE_TEST_FE_IMPORT_CASES_H

#include "dense.h"
#include "fe_mesh.h"
#include "hhtdae/flexible.h"
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <unistd.h>

namespace hhtest
{

inline Eigen::MatrixXd Dense(Mat A)
{
  Mat      d;
  PetscInt n;
  must(MatConvert(A, MATDENSE, MAT_INITIAL_MATRIX, &d));
  must(MatGetSize(A, &n, nullptr));
  const PetscScalar *a;
  must(MatDenseGetArrayRead(d, &a));
  Eigen::MatrixXd result = Eigen::Map<const Eigen::MatrixXd>(a, n, n);
  must(MatDenseRestoreArrayRead(d, &a));
  must(MatDestroy(&d));
  return result;
}

/* Frequencies in Hz, ascending; of an unsupported model without the six rigid-body modes, or with the nodes of a set
   held. Solved as M x = (K + s M) x / (l + s), because M is singular where few integration points are used */
inline std::vector<double> Frequencies(const FeModel &model, const std::vector<PetscInt> &held = {})
{
  std::vector<Eigen::Index> rows;
  for (PetscInt n = 0; n < model.nodes; n++)
    for (int c = 0; c < 3 && !std::count(held.begin(), held.end(), n); c++) rows.push_back(3 * n + c);
  const Eigen::MatrixXd K = Dense(model.K)(rows, rows), M = Dense(model.M)(rows, rows);
  const double          s    = 1e-6 * K.trace() / M.trace();
  const Eigen::VectorXd flexibilities = hhtest::EigenvaluesOf(M, K + s * M);
  std::vector<double>   f;
  for (Eigen::Index k = flexibilities.size() - (held.empty() ? 7 : 1); k >= 0; k--)
    f.push_back(std::sqrt(1 / std::max(flexibilities[k], 1e-300) - s) / (2 * PETSC_PI));
  return f;
}

inline double Difference(const Eigen::MatrixXd &a, const Eigen::MatrixXd &b) { return (a - b).norm() / b.norm(); }

inline double Difference(const std::vector<double> &a, const std::vector<double> &b, std::size_t n)
{
  double largest = 0;
  EXPECT_GE(a.size(), n);
  EXPECT_GE(b.size(), n);
  for (std::size_t k = 0; k < std::min({n, a.size(), b.size()}); k++)
    largest = std::max(largest, std::abs(a[k] / b[k] - 1));
  return largest;
}

/* A folder for the files of one test, removed by the destructor */
class Folder
{
public:
  std::string name;

  Folder() : name(testing::TempDir() + "hhtccx" + std::to_string(getpid()))
  {
    EXPECT_EQ(std::system(("rm -rf " + name + " && mkdir " + name).c_str()), 0);
  }
  ~Folder() { EXPECT_EQ(std::system(("rm -rf " + name).c_str()), 0); }
  Folder(const Folder &) = delete;
  std::string write(const std::string &file, const std::string &text) const
  {
    std::ofstream(name + "/" + file, std::ios::binary) << text;
    return name + "/" + file;
  }
  std::string read(const std::string &file) const
  {
    std::ifstream     in(name + "/" + file, std::ios::binary);
    std::stringstream all;
    all << in.rdbuf();
    return all.str();
  }
  bool ccx(const std::string &job) const
  {
    return std::system(("cd " + name + " && ccx " + job + " > " + job + ".out 2>&1").c_str()) == 0;
  }
};

#define EXPECT_SAYS(message, part) EXPECT_NE((message).find(part), std::string::npos) << message

} // namespace hhtest

#endif
