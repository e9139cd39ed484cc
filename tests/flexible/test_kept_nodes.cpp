/* Kept nodes and load cases of reduced bodies against the finite-element model from which they were made: its
   stiffness, volume and dynamics */
#include "dense.h"
#include "fe_mesh.h"
#include "hhtdae/flexible.h"
#include "reduction_cases.h"
#include "scene/model.h"
#include "scene_output.h"
#include <numeric>

using namespace hhtest;
using namespace hhtdae;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace
{

MatrixXd dense(Mat A)
{
  PetscInt m, n;
  must(MatGetSize(A, &m, &n));
  MatrixXd              D(m, n);
  std::vector<PetscInt> all(std::max(m, n));
  std::iota(all.begin(), all.end(), 0);
  must(MatGetValues(A, m, all.data(), n, all.data(), D.data()));
  return D.transpose();
}

/* All modes of a small unsupported body, so that the reduction is exact */
Reduction everything(PetscInt nodes)
{
  Reduction r;
  r.method    = Method::FreeFree;
  r.modes     = 3 * nodes - 6;
  r.node_sets = {"all"};
  return r;
}

Vector3 place(const FeModel &m, PetscInt i) { return Eigen::Map<const Vector3>(&m.coordinates[3 * i]); }

/* 2 x 1 x 1 bricks of a soft material; node i has the label i + 1 */
struct Small {
  FeModel    model{PETSC_COMM_SELF};
  BoxBuilder builder;
  Small() : builder(box(), &model)
  {
    builder.addSet("all", [](const Vector3 &) { return true; });
    builder.addSet("top", [](const Vector3 &x) { return x[2] > 0.19; });
  }
  static Box box()
  {
    Box b = {{2, 1, 1}, {0.6, 0.3, 0.2}};
    b.material = {1e6, 0.3, 1000};
    b.map      = [](Vector3 x) { return Vector3(x[0] + 0.1 * x[1], x[1] * (1 - 0.3 * x[0]), x[2]); };
    return b;
  }
};

void force(Scene &s, const std::string &name, Marker at, const Vector3 &f, bool moment = false)
{
  UserForce u;
  u.i = at;
  for (int k = 0; k < 3; k++) (moment ? u.moment : u.force).push_back(Expression(TimeFunction(f(k))));
  s.add(name, u);
}

} // namespace

/* Translations are those of the modes at the nodes; rotations follow rigid motions and, in bending, the slope of the axis */
TEST(KeptNodes, MotionsOfTheModes)
{
  Made        m(bar(16, 2, 2));
  ReducedBody body;
  Reduction   r = both(6);
  m.builder.addSet("middle", [](const Vector3 &x) { return std::abs(x[1] - 0.03) < 1e-9 && std::abs(x[2] - 0.04) < 1e-9; });
  r.node_sets = {"middle"};
  r.nodes     = {1, 2};
  must(Reduce(m.model, r, &body));
  ASSERT_EQ(body.modal.nodes.size(), 19u);
  EXPECT_EQ(body.modal.nodes[0].label, 1);
  std::vector<const ModalNode *> axis;
  for (const ModalNode &n : body.modal.nodes) {
    const PetscInt i = n.label - 1;
    EXPECT_TRUE(n.turns);
    EXPECT_EQ((n.position - place(m.model, i)).norm(), 0);
    EXPECT_EQ((n.translation - body.shape.middleRows<3>(3 * i)).norm(), 0);
    if (i > 1) axis.push_back(&n);
  }
  const double h = 0.5 / 16;
  int          bending = 0;
  for (PetscInt k = 0; k < body.modal.modes(); k++)
    for (int c : {1, 2}) { /* the slope of y is the rotation about z; the slope of z is the opposite of the rotation about y */
      double slope = 0, off = 0, most = 0;
      for (std::size_t j = 1; j + 1 < axis.size(); j++) {
        const double central = (axis[j + 1]->translation(c, k) - axis[j - 1]->translation(c, k)) / (2 * h) * (c == 1 ? 1 : -1);
        slope = std::max(slope, std::abs(central));
        off   = std::max(off, std::abs(central - axis[j]->rotation(3 - c, k)));
        most  = std::max(most, axis[j]->rotation.col(k).cwiseAbs().maxCoeff());
      }
      if (slope < 0.5 * most || body.modal.omega[k] > 3 * body.modal.omega[0]) continue; /* only in slender bending do plane sections stay plane */
      bending++;
      EXPECT_LT(off, 0.1 * slope) << "mode " << k;
    }
  EXPECT_GE(bending, 2);
}

TEST(KeptNodes, WhatIsAskedForWrongly)
{
  Small     s;
  Reduction r = everything(s.model.nodes);
  const auto says = [&](const std::string &part) {
    ReducedBody body;
    ErrorTrap   trap;
    EXPECT_NE(Reduce(s.model, r, &body), 0);
    EXPECT_TRUE(trap.says(part)) << trap.message;
    r = everything(s.model.nodes);
  };
  r.node_sets = {"none such"};
  says("Nodes to be kept: the model has no node set 'none such'; its sets are: all, left, right, top");
  r.nodes = {3, 99};
  says("Reduction::nodes: the model has no node 99");
  r.loads = {LoadCase{"wind", "none such"}};
  says("Load case wind: the model has no node set 'none such'");
  r.loads = {LoadCase{"wind", "top"}, LoadCase{"wind", "top"}};
  says("Load case 1 has no name, or that of another one: 'wind'");
  r.loads = {LoadCase{"wind"}};
  says("Load case wind: give either a surface for a pressure, or nodes with forces");
  r.loads = {LoadCase{"wind", "", true, {3}, {1, 2}}};
  says("Load case wind: 2 numbers of force for 1 nodes");
  r.loads = {LoadCase{"wind", "", true, {3}, {1, 2, NAN}}};
  says("Load case wind: a force is not finite");
  r.loads = {LoadCase{"wind", "", true, {99}, {1, 2, 3}}};
  says("Load case wind: the model has no node 99");
  s.builder.addSet("edge", [](const Vector3 &x) { return x[2] > 0.19 && x[1] > 0.29; });
  r.loads = {LoadCase{"wind", "edge"}};
  says("Load case wind: no outer face of the mesh has all of its nodes in the set 'edge'");
  s.model.elements.clear();
  r.loads = {LoadCase{"wind", "top"}};
  says("Load case wind: pressure needs elements");
}

/* Held at the nodes of one end and loaded at another node by a force or moment, in static equilibrium: displacements
   follow from the stiffness of the model */
TEST(KeptNodes, StaticsOfTheModel)
{
  Small       s;
  ReducedBody body;
  must(Reduce(s.model, everything(s.model.nodes), &body));
  const auto            model = std::make_shared<ModalBody>(body.modal);
  const MatrixXd        K     = dense(s.model.K);
  std::vector<PetscInt> held, free;
  for (PetscInt i = 0; i < s.model.nodes; i++) (std::count(s.model.sets["left"].begin(), s.model.sets["left"].end(), i) ? held : free).push_back(i);
  MatrixXd Kff(3 * free.size(), 3 * free.size());
  for (std::size_t a = 0; a < free.size(); a++)
    for (std::size_t b = 0; b < free.size(); b++) Kff.block<3, 3>(3 * a, 3 * b) = K.block<3, 3>(3 * free[a], 3 * free[b]);
  const std::size_t      at   = free.size() - 2;
  const ModalNode       &node = model->nodes[free[at]];
  const Vector3          load(0.01, -0.02, 0.03);
  for (bool moment : {false, true}) {
    /* the work of a moment is its product with the node's rotation, which is a combination of displacements */
    VectorXd f = VectorXd::Zero(Kff.rows());
    if (moment) {
      const MatrixXd rows = node.rotation * (body.shape.transpose() * dense(s.model.M)); /* for displacements without rigid motion */
      VectorXd       all  = rows.transpose() * load;
      /* for rigid motions: the supports balance the load, so that together they form a moment that is the same about
         any point */
      MatrixXd rigid(3 * s.model.nodes, 6);
      for (PetscInt i = 0; i < s.model.nodes; i++) rigid.middleRows<3>(3 * i) << Matrix3::Identity(), -Cross<double>(place(s.model, i) - model->center);
      const MatrixXd            M     = dense(s.model.M);
      Eigen::Matrix<double, 6, 1> work;
      work << Vector3::Zero(), load;
      all += M * rigid * hhtest::SolveDense(rigid.transpose() * M * rigid, work);
      for (std::size_t a = 0; a < free.size(); a++) f.segment<3>(3 * a) = all.segment<3>(3 * free[a]);
    } else
      f.segment<3>(3 * at) = load;
    const VectorXd u = hhtest::SolveDense(Kff, f);
    Scene          scene(PETSC_COMM_SELF);
    FlexibleBody   b;
    b.model          = model;
    const Body flex  = scene.add("body", b);
    for (PetscInt i : held) {
      const Marker m = scene.marker(scene.node(flex, i + 1));
      scene.add(text("hold %d", (int)i), Spherical{m, scene.marker(scene.ground(), place(s.model, i))});
    }
    const Marker there = scene.marker(scene.node(flex, free[at] + 1));
    force(scene, "push", there, load, moment);
    for (std::size_t a = 0; a < free.size(); a++) {
      const Marker m = scene.marker(scene.node(flex, free[a] + 1));
      for (int c = 0; c < 3; c++) scene.channel(text("u%d%d", (int)a, c), Measure::displacement(m, c, scene.marker(scene.ground(), place(s.model, free[a]))));
    }
    scene.start().equilibrium = true;
    TS    ts;
    Array x;
    must(scene.createTS(&ts));
    must(TSSetMaxTime(ts, 1e-5));
    must(TSSetTimeStep(ts, 1e-5));
    must(scene.solve(ts));
    must(scene.sample(ts, 1e-5, x));
    must(TSDestroy(&ts));
    const double off = (Eigen::Map<const VectorXd>(x.data(), u.size()) - u).norm() / u.norm();
    MEASURED("%s: displacement %.3e, relative difference %.2e", moment ? "moment" : "force", u.cwiseAbs().maxCoeff(), off);
    EXPECT_LT(off, 2e-4); /* geometric nonlinearity, of the order of u/length */
  }
}

namespace
{

/* Volume of a mesh of solids for given positions of its nodes */
double volume(const FeModel &m, const VectorXd &x)
{
  double sum = 0;
  for (const FeElement &e : m.elements)
    sum += fe::WithShape(e.type, [&](auto shape) {
      using Shape = decltype(shape);
      double     v = 0;
      const auto p = Shape::MassRule::points();
      for (int q = 0; q < Shape::MassRule::count; q++) {
        fe::Gradients<Shape::nodes> d;
        Matrix3                     J = Matrix3::Zero();
        Shape::gradient(p.at[q], d);
        for (int a = 0; a < Shape::nodes; a++) J += x.segment<3>(3 * e.node[a]) * d.col(a).transpose();
        v += p.weight[q] * J.determinant();
      }
      return v;
    });
  return sum;
}

} // namespace

/* Uniform pressure on the whole surface does the work - dV: its modal work and the derivatives of it are those of the
   volume, and its resultant vanishes */
TEST(KeptNodes, PressureAllAroundIsTheVolume)
{
  for (ElementType type : {ElementType::Tetrahedron4, ElementType::Tetrahedron10, ElementType::Brick8, ElementType::Brick20}) {
    MeshBox box;
    box.type = type;
    box.nx = 2, box.ny = box.nz = 1;
    box.map = [](const Vector3 &x) { return Vector3(x[0] + 0.2 * x[1] * x[2], x[1] + 0.1 * x[0] * x[0], x[2] * (1 + 0.3 * x[0])); };
    FeModel model(PETSC_COMM_SELF);
    must(readBox(model, box));
    std::vector<PetscInt> all(model.nodes);
    std::iota(all.begin(), all.end(), 0);
    must(model.addSet("all", all));
    Reduction   r;
    ReducedBody body;
    r.method = Method::FreeFree;
    r.modes  = 10;
    r.loads  = {LoadCase{"around", "all"}, LoadCase{"fixed", "all", false}, LoadCase{"left", "left"}};
    must(Reduce(model, r, &body));
    const ModalLoadCase &p = body.modal.loads[0], &fixed = body.modal.loads[1], &left = body.modal.loads[2];
    const VectorXd       X = Eigen::Map<const VectorXd>(model.coordinates.data(), 3 * model.nodes);
    const double         size = std::sqrt(volume(model, X)), phi = body.shape.cwiseAbs().maxCoeff();
    const double         h = 1e-4 / phi;
    const PetscInt       m = body.modal.modes();
    const auto           V = [&](PetscInt k, PetscInt l, double a, double b) { return volume(model, X + h * a * body.shape.col(k) + h * b * body.shape.col(l)); };
    double               off = 0, off2 = 0;
    for (PetscInt k = 0; k < m; k++) {
      off = std::max(off, std::abs(p.modal(k) + (V(k, k, 1, 0) - V(k, k, -1, 0)) / (2 * h)));
      for (PetscInt l = 0; l < m; l++)
        off2 = std::max(off2, std::abs(p.modal_gradient(k, l) + (V(k, l, 1, 1) - V(k, l, 1, -1) - V(k, l, -1, 1) + V(k, l, -1, -1)) / (4 * h * h)));
    }
    MEASURED("%s: work off by %.1e of %.1e, its derivatives by %.1e of %.1e", fe::ShapeName(type), off, p.modal.cwiseAbs().maxCoeff(), off2, p.modal_gradient.cwiseAbs().maxCoeff());
    EXPECT_LT(off, 1e-6 * (p.modal.cwiseAbs().maxCoeff() + phi * size));
    EXPECT_LT(off2, 1e-5 * (p.modal_gradient.cwiseAbs().maxCoeff()));
    EXPECT_LT(p.force.norm() + p.moment.norm() + (p.force_gradient.norm() + p.moment_gradient.norm()) / phi, 1e-10);
    EXPECT_LT((p.modal_gradient - p.modal_gradient.transpose()).norm(), 1e-10 * p.modal_gradient.norm());
    EXPECT_LT((p.modal - fixed.modal).norm(), 1e-13 * p.modal.norm());
    EXPECT_EQ(fixed.modal_gradient.size() + fixed.force_gradient.size(), 0);
    EXPECT_GT(fixed.moment_gradient.norm(), 0.1 * phi);
    EXPECT_NEAR(left.force(0), 1, 0.5); /* points inwards on the end x = 0, whose area is about one */
  }
}

/* Derivatives of resultant force and moment with respect to the modal coordinates are those of the pressure on the
   displaced surface, which the test integrates over bilinear patches */
TEST(KeptNodes, PressureFollowsTheSurface)
{
  Small       s;
  ReducedBody body;
  Reduction   r = everything(s.model.nodes);
  r.loads       = {LoadCase{"top", "top"}};
  must(Reduce(s.model, r, &body));
  const ModalLoadCase &p = body.modal.loads[0];
  const VectorXd       X = Eigen::Map<const VectorXd>(s.model.coordinates.data(), 3 * s.model.nodes);
  const auto           load = [&](const VectorXd &x) { /* force and moment on the top faces (nodes 4 to 7 of each brick, outward normal up) */
    Eigen::Matrix<double, 6, 1> f = Eigen::Matrix<double, 6, 1>::Zero();
    for (const FeElement &e : s.model.elements) {
      const Vector3 a = x.segment<3>(3 * e.node[4]), b = x.segment<3>(3 * e.node[5]), c = x.segment<3>(3 * e.node[6]), d = x.segment<3>(3 * e.node[7]);
      const int     n = 40;
      for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
          const double  u = (i + 0.5) / n, v = (j + 0.5) / n;
          const Vector3 at = (1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d;
          const Vector3 df = -((1 - v) * (b - a) + v * (c - d)).cross((1 - u) * (d - a) + u * (c - b)) / (n * n);
          f.head<3>() += df;
          f.tail<3>() += (at - body.modal.center).cross(df);
        }
    }
    return f;
  };
  const Eigen::Matrix<double, 6, 1> rest = load(X);
  EXPECT_LT((rest.head<3>() - p.force).norm(), 1e-12);
  EXPECT_LT((rest.tail<3>() - p.moment).norm(), 1e-4 * p.force.norm());
  const double h = 1e-5 / body.shape.cwiseAbs().maxCoeff();
  for (PetscInt k = 0; k < body.modal.modes(); k++) {
    const Eigen::Matrix<double, 6, 1> by = (load(X + h * body.shape.col(k)) - load(X - h * body.shape.col(k))) / (2 * h);
    EXPECT_LT((by.head<3>() - p.force_gradient.col(k)).norm(), 1e-6 * (1e-2 + by.norm()));
    EXPECT_LT((by.tail<3>() - p.moment_gradient.col(k)).norm(), 2e-3 * (1e-2 + by.norm())); /* integrated by the midpoint rule */
  }
}

/* A pressure pulse on a free body: modal coordinates and rigid motion are those of the model's equations, integrated
   mode by mode of K x = l M x */
TEST(KeptNodes, DynamicsUnderPressure)
{
  Small       s;
  ReducedBody body;
  Reduction   r = everything(s.model.nodes);
  r.loads       = {LoadCase{"top", "top", false}};
  must(Reduce(s.model, r, &body));
  const double p = 2, w = 20, t = 0.1;
  Scene        scene(PETSC_COMM_SELF);
  FlexibleBody b;
  b.model         = std::make_shared<ModalBody>(body.modal);
  const Body flex = scene.add("body", b);
  scene.add("pressure", ModalLoad{flex, "top", TimeFunction::harmonic(p, w)});
  for (PetscInt i = 0; i < s.model.nodes; i++)
    for (int c = 0; c < 3; c++) scene.channel(text("u%d%d", (int)i, c), Measure::displacement(scene.marker(scene.node(flex, i + 1)), c, scene.marker(scene.ground(), place(s.model, i))));
  SceneRun run(scene, t, tolerance(1e-10) + " -ts_hhtdae_corrector_tolerance 1e-7 ");
  Array    x;
  must(run.solve());
  must(scene.sample(run.ts, t, x));
  /* consistent nodal forces of a unit pressure, by 2 x 2 Gauss points on each top face */
  VectorXd       f(3 * s.model.nodes);
  const VectorXd X = Eigen::Map<const VectorXd>(s.model.coordinates.data(), 3 * s.model.nodes);
  f.setZero();
  for (const FeElement &e : s.model.elements) {
    const double g = 1 / std::sqrt(3.);
    const int    sign[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    for (double u : {-g, g})
      for (double v : {-g, g}) {
        Vector3 xu = Vector3::Zero(), xv = Vector3::Zero();
        for (int a = 0; a < 4; a++) {
          xu += sign[a][0] * (1 + sign[a][1] * v) / 4 * X.segment<3>(3 * e.node[4 + a]);
          xv += sign[a][1] * (1 + sign[a][0] * u) / 4 * X.segment<3>(3 * e.node[4 + a]);
        }
        for (int a = 0; a < 4; a++) f.segment<3>(3 * e.node[4 + a]) -= (1 + sign[a][0] * u) * (1 + sign[a][1] * v) / 4 * xu.cross(xv);
      }
  }
  const hhtest::DenseModes eig = hhtest::ModesOf(dense(s.model.K), dense(s.model.M));
  VectorXd                 u   = VectorXd::Zero(f.size());
  for (Eigen::Index k = 0; k < f.size(); k++) {
    const double q = eig.vectors.col(k).dot(f) * p, o = std::sqrt(std::max(0.0, eig.values(k)));
    u += eig.vectors.col(k) * (k < 6 ? q * (t / w - std::sin(w * t) / (w * w)) : q * (std::sin(w * t) - w / o * std::sin(o * t)) / (o * o - w * w));
  }
  const double off = (Eigen::Map<const VectorXd>(x.data(), u.size()) - u).norm() / u.norm();
  MEASURED("displacement %.3e, relative difference %.2e", u.cwiseAbs().maxCoeff(), off);
  EXPECT_LT(off, 1e-3);
}

/* A block on springs whose bottom nodes are pressed on a plane: the deflection follows from the stiffness of the model
   and of the contact, and from the weight at each node */
TEST(KeptNodes, ABlockOnThePlane)
{
  Small       s;
  ReducedBody body;
  must(Reduce(s.model, everything(s.model.nodes), &body));
  const double k = 2e4, g = 9.81;
  Scene        scene(PETSC_COMM_SELF);
  FlexibleBody b;
  ContactLaw   law;
  b.model        = std::make_shared<ModalBody>(body.modal);
  b.position     = {0, 0, -0.003};
  law.stiffness  = k;
  law.exponent   = 1;
  law.friction   = 1; /* holds the block in the plane */
  law.slip_velocity = 1;
  const Body    flex  = scene.add("block", b);
  const Element touch = scene.add("touch", NodeContact{flex, {}, 0, scene.marker(scene.ground()), 0, law});
  scene.gravity({0, 0, -g});
  for (PetscInt i = 0; i < s.model.nodes; i++) scene.channel(text("z%d", (int)i), Measure::displacement(scene.marker(scene.node(flex, i + 1)), 2));
  scene.channel("force", Measure::force(touch, 2));
  /* at rest there is no tangential force: two weak springs prevent the three motions in the plane */
  const Marker c = scene.marker(scene.node(flex, 1)), e = scene.marker(scene.node(flex, 12));
  for (int n = 0; n < 2; n++) {
    const Vector3 at = place(s.model, n ? 11 : 0);
    scene.add(text("hold %d", n), Bushing{n ? e : c, scene.marker(scene.ground(), at), {1, 1, 0}});
  }
  scene.start().equilibrium = true;
  TS    ts;
  Array x;
  must(scene.createTS(&ts));
  must(TSSetMaxTime(ts, 1e-6));
  must(TSSetTimeStep(ts, 1e-6));
  must(scene.solve(ts));
  must(scene.sample(ts, 1e-6, x));
  must(TSDestroy(&ts));
  MatrixXd K = dense(s.model.K);
  VectorXd f = VectorXd::Zero(K.rows()), down = f;
  for (PetscInt i = 0; i < s.model.nodes; i++) {
    down(3 * i + 2) = -g;
    const double z = place(s.model, i)(2);
    if (z > 1e-9) continue;
    K(3 * i + 2, 3 * i + 2) += k;
    f(3 * i + 2) -= k * z;
  }
  for (PetscInt i : {(PetscInt)0, (PetscInt)11})
    for (int d : {0, 1}) K(3 * i + d, 3 * i + d) += 1;
  f += dense(s.model.M) * down;
  const VectorXd u = hhtest::SolveDense(K, f);
  double         off = 0, most = 0;
  for (PetscInt i = 0; i < s.model.nodes; i++) {
    off  = std::max(off, std::abs(x[i] - place(s.model, i)(2) - u(3 * i + 2)));
    most = std::max(most, std::abs(u(3 * i + 2)));
  }
  MEASURED("sinks by %.3e, off by %.1e; force %.9g, weight %.9g", most, off, x[s.model.nodes], body.modal.mass * g);
  EXPECT_LT(off, 2e-3 * most);
  EXPECT_NEAR(x[s.model.nodes], body.modal.mass * g, 1e-4 * body.modal.mass * g);
}

/* Held at one end and shaken by equal forces on the nodes of the other end: the whole finite-element body and the
   modal body with these forces as a load case have the same motion */
TEST(KeptNodes, DynamicsOfTheWholeBody)
{
  const double t = 0.15;
  const auto   shake = [](int c) { return TimeFunction::harmonic(0.1 * (c + 1), 30); };
  Small        whole, s;
  Scene        fe_scene(PETSC_COMM_SELF), scene(PETSC_COMM_SELF);
  FullFeBody   fe;
  FullBody     full;
  full.law         = FeLaw::Small;
  full.attachments = {attach("left"), attach("right", Tie::Average)};
  must(fe.add(fe_scene, "block", whole.model, full));
  const Marker left = fe_scene.marker(fe.attachment("left"));
  const auto   at   = DataOf(fe_scene).frame(left);
  UserForce    f;
  fe_scene.add("clamp", Fixed{left, fe_scene.marker(fe_scene.ground(), at.x, at.R)});
  f.i = fe_scene.marker(fe.attachment("right"));
  for (int c = 0; c < 3; c++) f.force.push_back(shake(c));
  fe_scene.add("shake", f);
  Array    x, y;
  SceneRun first(fe_scene, t, tolerance(1e-10) + " -ts_hhtdae_corrector_tolerance 1e-6 ");
  must(first.solve());
  must(fe.positions(first.ts, t, &x));

  ReducedBody body;
  Reduction   r     = everything(s.model.nodes);
  const auto &right = s.model.sets["right"];
  for (int c = 0; c < 3; c++) {
    LoadCase l{std::string(1, "xyz"[c])};
    for (PetscInt i : right) {
      const Vector3 one = Vector3::Unit(c) / (double)right.size();
      l.node.push_back(i + 1);
      l.force.insert(l.force.end(), one.data(), one.data() + 3);
    }
    r.loads.push_back(l);
  }
  must(Reduce(s.model, r, &body));
  FlexibleBody b;
  b.model         = std::make_shared<ModalBody>(body.modal);
  const Body flex = scene.add("block", b);
  for (PetscInt i : s.model.sets["left"]) {
    const Marker m = scene.marker(scene.node(flex, i + 1));
    scene.add(text("hold %d", (int)i), Spherical{m, scene.marker(scene.ground(), place(s.model, i))});
  }
  for (int c = 0; c < 3; c++) scene.add(text("shake %d", c), ModalLoad{flex, std::string(1, "xyz"[c]), shake(c)});
  for (PetscInt i : right)
    for (int c = 0; c < 3; c++) scene.channel(text("x%d%d", (int)i, c), Measure::displacement(scene.marker(scene.node(flex, i + 1)), c));
  SceneRun second(scene, t, tolerance(1e-10) + " -ts_hhtdae_corrector_tolerance 1e-6 ");
  must(second.solve());
  must(scene.sample(second.ts, t, y));
  double most = 0, off = 0;
  for (std::size_t k = 0; k < right.size(); k++) {
    const Vector3 u = Eigen::Map<const Vector3>(&x[3 * right[k]]), v = Eigen::Map<const Vector3>(&y[3 * k]), X = place(s.model, right[k]);
    most = std::max(most, (u - X).norm());
    off  = std::max(off, (u - v).norm());
  }
  MEASURED("displacement %.3e, difference %.1e", most, off);
  EXPECT_GT(most, 1e-6);
  EXPECT_LT(off, 5e-3 * most);
}
