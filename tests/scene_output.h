/* Shared by the tests of a scene's results: temporary files, tables read back, swinging rods */
#ifndef HHTDAE_TESTS_SCENE_OUTPUT_H
#define HHTDAE_TESTS_SCENE_OUTPUT_H

#include "hhtdae/scene.h"
#include "support.h"
#include <fstream>
#include <sstream>
#include <unistd.h>

namespace hhtest
{

using namespace hhtdae;

/* A unique file name; the files are removed by the destructor */
class TemporaryFile
{
public:
  std::string name;

  explicit TemporaryFile(const std::string &end) : name(testing::TempDir() + "hhtscene" + std::to_string(getpid()) + "_" + end) {}
  ~TemporaryFile() { std::remove(name.c_str()); }
  TemporaryFile(const TemporaryFile &) = delete;
  std::string text() const
  {
    std::ifstream     in(name);
    std::stringstream all;
    all << in.rdbuf();
    return all.str();
  }
  bool exists() const { return std::ifstream(name).good(); }
};

inline Measure energy(Measure::Kind kind)
{
  Measure m;
  m.kind = kind;
  return m;
}

/* A CSV file: names of the columns, rows of numbers */
struct CSV {
  std::vector<std::string> name;
  std::vector<Array>       row;

  explicit CSV(const std::string &text)
  {
    std::istringstream lines(text);
    std::string        line, field;
    std::getline(lines, line);
    for (std::istringstream f(line); std::getline(f, field, ',');) name.push_back(field);
    while (std::getline(lines, line)) {
      row.emplace_back();
      for (std::istringstream f(line); std::getline(f, field, ',');) row.back().push_back(std::stod(field));
      if (row.back().size() != name.size()) throw std::runtime_error("a row of the table has " + std::to_string(row.back().size()) + " fields");
    }
  }
  Array column(const std::string &what) const
  {
    for (std::size_t c = 0; c < name.size(); c++)
      if (name[c] == what || name[c].rfind(what + " [", 0) == 0) {
        Array a;
        for (const Array &r : row) a.push_back(r[c]);
        return a;
      }
    throw std::runtime_error("no column " + what);
  }
};

/* The TS of a scene, set up from options */
class SceneRun
{
public:
  TS ts = nullptr;

  SceneRun(Scene &scene, double end, const std::string &options) : scene_(scene), options_(options)
  {
    Options in(options_);
    must(scene.createTS(&ts));
    must(TSSetMaxTime(ts, end));
    must(TSSetFromOptions(ts));
  }
  ~SceneRun() { TSDestroy(&ts); }
  SceneRun(const SceneRun &) = delete;
  PetscErrorCode solve()
  {
    Options in(options_);
    return scene_.solve(ts);
  }

private:
  Scene      &scene_;
  std::string options_;
};

/* N rods of length 1, mass 1 on revolute joints about the space z axis, horizontal and at rest at the start; gravity along -y */
struct Rods {
  Scene                scene;
  std::vector<Body>    body;
  std::vector<Marker>  centre, tip;
  std::vector<Element> pin;

  explicit Rods(int n, MPI_Comm comm = PETSC_COMM_SELF) : scene(comm)
  {
    Marker last = scene.marker(scene.ground());
    scene.gravity({0, -9.81, 0});
    for (int k = 0; k < n; k++) {
      RigidBody b;
      b.inertia  = Vector3(0.01, 1. / 12, 1. / 12).asDiagonal();
      b.position = {k + 0.5, 0, 0};
      body.push_back(scene.add("rod" + std::to_string(k), b));
      centre.push_back(scene.marker(body[k]));
      tip.push_back(scene.marker(body[k], {0.5, 0, 0}));
      pin.push_back(scene.add("pin" + std::to_string(k), Revolute{scene.marker(body[k], {-0.5, 0, 0}), last}));
      last = tip[k];
    }
  }
};

} // namespace hhtest

#endif
