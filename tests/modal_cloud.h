/* A flexible body made of point masses with given modes: every inertia quantity can be computed as a sum over particles */
#ifndef HHTDAE_TESTS_MODAL_CLOUD_H
#define HHTDAE_TESTS_MODAL_CLOUD_H

#include "hhtdae/modal.h"

#include <Eigen/Dense>
#include <random>

namespace hhtest
{

struct ModalCloud {
  std::vector<double>          mass;
  std::vector<hhtdae::Vector3> X;     /* positions from the centre of mass */
  Eigen::MatrixXd              shape; /* 3 rows per particle, one column per mode */
  hhtdae::ModalBody            body;

  /* free: modes neither move the centre of mass nor turn the body, like the modes of an unsupported body */
  ModalCloud(int particles, int modes, unsigned seed, bool free = true)
  {
    std::mt19937                           random(seed);
    std::uniform_real_distribution<double> any(-1, 1);
    hhtdae::Vector3                        center = hhtdae::Vector3::Zero();
    for (int p = 0; p < particles; p++) {
      mass.push_back(1.5 + any(random));
      X.emplace_back(2 * any(random), any(random), 0.5 * any(random));
      body.mass += mass.back();
      center += mass.back() * X.back();
    }
    for (auto &x : X) x -= center / body.mass;
    makeShapes(modes, random, free);
    makeBody(modes, random);
  }

  /* Random stiffening by angular velocity and by loads on the attachments */
  void stiffen(unsigned seed)
  {
    std::mt19937                           random(seed);
    std::uniform_real_distribution<double> any(-1, 1);
    const auto                             symmetric = [&](Eigen::MatrixXd &B) {
      B = Eigen::MatrixXd::NullaryExpr(body.modes(), body.modes(), [&] { return any(random); });
      B = 0.1 * (B + B.transpose()).eval();
    };
    for (auto &B : body.stiffening) symmetric(B);
    for (auto &a : body.attachments)
      for (auto &B : a.stiffening) symmetric(B);
  }
  /* Every particle p is a kept node with the label 10 + 3 p, those with odd p have rotations; load case "dead": forces
     on all particles that are fixed in body axes; load case "follows": with random gradients */
  static hhtdae::Vector3 deadForce(std::size_t p) { return {0.3 + (double)p, -1., 0.2 * (double)p}; }
  void                   keepNodes(unsigned seed)
  {
    const int                              modes = (int)body.modes();
    std::mt19937                           random(seed);
    std::uniform_real_distribution<double> any(-1, 1);
    const auto                             numbers = [&](int rows, int columns) { return Eigen::MatrixXd(Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return any(random); })); };
    hhtdae::ModalLoadCase                  dead;
    dead.name            = "dead";
    dead.modal           = Eigen::VectorXd::Zero(modes);
    dead.moment_gradient = Eigen::MatrixXd::Zero(3, modes);
    for (std::size_t p = 0; p < X.size(); p++) {
      const hhtdae::Vector3 f = deadForce(p);
      hhtdae::ModalNode     n;
      n.label       = 10 + 3 * (PetscInt)p;
      n.position    = X[p];
      n.translation = shape.middleRows<3>(3 * p);
      n.turns       = p % 2 == 1;
      n.rotation    = n.turns ? numbers(3, modes) : Eigen::MatrixXd::Zero(3, modes);
      body.nodes.push_back(n);
      dead.force += f;
      dead.moment += X[p].cross(f);
      dead.modal += n.translation.transpose() * f;
      for (int k = 0; k < modes; k++) dead.moment_gradient.col(k) += hhtdae::Vector3(n.translation.col(k)).cross(f);
    }
    body.loads.assign(2, dead);
    body.loads[1].name           = "follows";
    body.loads[1].force_gradient = numbers(3, modes);
    body.loads[1].modal_gradient = numbers(modes, modes);
  }
  /* y^T m z over all particles, y and z stacked */
  double product(const Eigen::VectorXd &y, const Eigen::VectorXd &z) const
  {
    double sum = 0;
    for (std::size_t p = 0; p < mass.size(); p++) sum += mass[p] * y.segment<3>(3 * p).dot(z.segment<3>(3 * p));
    return sum;
  }
  hhtdae::Vector3 place(std::size_t p, const hhtdae::Vector3 &r, const hhtdae::Matrix3 &A, const Eigen::VectorXd &eta) const
  {
    return r + A * (X[p] + shape.middleRows<3>(3 * p) * eta);
  }

private:
  void makeShapes(int modes, std::mt19937 &random, bool free)
  {
    const int                              n = 3 * (int)mass.size();
    std::uniform_real_distribution<double> any(-1, 1);
    std::vector<Eigen::VectorXd>           base;
    for (int k = 0; k < 6 && free; k++) {
      Eigen::VectorXd v(n);
      for (std::size_t p = 0; p < mass.size(); p++) {
        const hhtdae::Vector3 e = hhtdae::Vector3::Unit(k % 3);
        v.segment<3>(3 * p)     = k < 3 ? e : hhtdae::Vector3(e.cross(X[p]));
      }
      base.push_back(v);
    }
    for (int k = 0; k < modes; k++) base.push_back(Eigen::VectorXd::NullaryExpr(n, [&] { return any(random); }));
    for (std::size_t k = 0; k < base.size(); k++) {
      for (int twice = 0; twice < 2; twice++)
        for (std::size_t l = 0; l < k; l++) base[k] -= product(base[l], base[k]) * base[l];
      base[k] /= std::sqrt(product(base[k], base[k]));
    }
    shape.resize(n, modes);
    for (int k = 0; k < modes; k++) shape.col(k) = base[base.size() - modes + k];
  }

  void makeBody(int m, std::mt19937 &random)
  {
    std::uniform_real_distribution<double> any(-1, 1);
    body.name  = "cloud";
    body.omega = Eigen::VectorXd::LinSpaced(m, 5, 5 + 3. * m);
    body.first.setZero(3, m);
    for (auto &x : body.moment) x.setZero(3, m);
    for (auto &x : body.quadratic) x.setZero(m, m);
    for (std::size_t p = 0; p < mass.size(); p++) {
      const Eigen::MatrixXd S = shape.middleRows<3>(3 * p);
      body.moments += mass[p] * X[p] * X[p].transpose();
      body.first += mass[p] * S;
      for (int c = 0; c < 3; c++) {
        body.moment[c] += mass[p] * X[p](c) * S;
        body.quadratic[c] += mass[p] * S.row(c).transpose() * S.row(c);
        body.quadratic[3 + c] += mass[p] * S.row(c).transpose() * S.row((c + 1) % 3);
      }
    }
    for (std::size_t p = 0; p < 2; p++) {
      hhtdae::ModalAttachment a;
      a.name        = p ? "tip" : "hub";
      a.position    = X[p];
      a.translation = shape.middleRows<3>(3 * p);
      a.rotation    = 0.5 * Eigen::MatrixXd::NullaryExpr(3, m, [&] { return any(random); });
      body.attachments.push_back(a);
    }
  }
};

} // namespace hhtest

#endif
