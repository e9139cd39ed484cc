/* Model k of seed s: a scene generated at random from trees, loops, machines, contacts and flexible bodies, with its
   observed channels */
#ifndef HHTDAE_SOAK_MODEL_H
#define HHTDAE_SOAK_MODEL_H

#include "model_choice.h"
#include "model_extras.h"
#include "model_loads.h"
#include "model_machines.h"
#include "model_switches.h"
#include <cstring>

namespace soak
{

enum class Observed { Position, Velocity, Reaction, Energy };

struct Model {
  std::shared_ptr<Scene> scene;
  hhtest::Specs          specs; /* descriptions of its elements, for the balances */
  bool                   planar = false, conservative = false, switched = false;
  int                    bodies = 0;
  double                 end = 0, length = 1, mass = 1, period = 1, stiffest = 0, softest = 0, speed = 0;
  double                 jump = 0; /* acceleration of an element after its release; 0: nothing is released */
  Impact                 impact; /* of hard contacts */
  std::vector<Observed>  observed;  /* kind of each channel of the scene */
  std::map<std::string, int> types; /* numbers of elements by type, and of features */
};

class Generator
{
public:
  Generator(std::uint64_t seed, std::uint64_t number, const Choice &choice, const std::vector<ReducedPart> &parts,
            const Vector3 &push = Vector3::Zero())
      : r(seed, number), later_(~seed, number), extra_(seed + 0x9e3779b97f4a7c15u, number), small_(choice.small), switches_(choice.switches), extras_(choice.extras),
        parts_(parts), push_(push)
  {
  }

  Model make()
  {
    Model m;
    m.planar = r.chance(0.25);
    m.scene  = std::make_shared<Scene>(PETSC_COMM_SELF, m.planar ? Space::Planar : Space::Spatial);
    Builder b(*m.scene, r, m.planar);
    scales(b);
    Loads    loads(b);
    Machines machines(b, parts_);
    populate(b, loads, machines);
    addExtras(b);
    decorate(b, loads);
    if (b.speed > 0 || b.project) m.scene->start().assembly = Assembly::Project;
    observe(b, machines, loads, m);
    m.end = b.period * r.uniform(0.3, 2) * (b.bodies() > 60 ? 0.5 : 1);
    addSwitches(b, m);
    m.bodies       = b.bodies();
    m.length       = b.length;
    m.mass         = b.mass;
    m.period       = b.period;
    m.stiffest     = b.stiffest;
    m.softest      = b.softest;
    m.speed        = b.speed;
    m.conservative = !b.lossy && !dissipates(*m.scene);
    m.specs        = b.specs;
    count(b, m);
    return m;
  }

private:
  Random r, later_, extra_; /* the latter two generate what was added to the models later, so that the rest is unchanged */
  bool   small_, switches_, extras_;
  const std::vector<ReducedPart> &parts_;
  const Vector3 push_; /* a small change of gravity and positions, relative to their size, which gives the same model disturbed */

  void scales(Builder &b)
  {
    b.length       = r.logarithmic(0.2, 2);
    b.mass         = r.logarithmic(1e-3, 1e3);
    const double g = r.chance(0.15) ? 0 : r.chance(0.1) ? r.logarithmic(0.1, 100) : 9.81;
    b.gravity      = -g * (r.chance(0.9) ? b.up : b.direction());
    b.period       = g > 0 ? 2 * M_PI * std::sqrt(b.length / g) : r.logarithmic(0.1, 3);
    b.speed        = g == 0 || r.chance(0.45) ? r.logarithmic(0.1, 5) : 0;
    b.push         = push_;
    Vector3 more   = b.weightPerMass() * push_;
    if (b.planar) more(2) = 0;
    b.scene.gravity(b.gravity + more);
  }

  /* most models are small, a few have 100 to 200 bodies */
  int size()
  {
    if (small_) return (int)r.logarithmic(1, 8);
    if (r.chance(0.025)) return r.integer(100, 200);
    return (int)std::pow(61., std::pow(r.uniform(), 1.5));
  }

  void populate(Builder &b, Loads &loads, Machines &machines)
  {
    Trees     trees(b);
    const int n = size();
    if (!b.planar && !small_ && r.chance(0.1)) machines.flexible();
    if (!b.planar && small_ && r.chance(0.05)) machines.flexible();
    while (b.bodies() < n) {
      const int rest = n - b.bodies();
      switch (b.planar ? r.choose({6, 4, 0, 0, 2, 1.5, 3, 0.5, 1.2, 0})
                       : r.choose({7, 2, 3, 1, 2, 2.5, 3, 0.5, 1.2, 0.8})) {
      case 0:
        trees.tree(rest > 40 ? r.integer(rest / 2, rest) : r.integer(1, rest));
        break;
      case 1:
        trees.planeLoop();
        break;
      case 2:
        trees.spaceLoop();
        break;
      case 3:
        trees.platform();
        break;
      case 4:
        machines.couple();
        break;
      case 5:
        machines.roll();
        break;
      case 6:
        machines.contact();
        break;
      case 7:
        machines.shaker([&] { return loads.motion(b.length * r.uniform(0.05, 0.3)); });
        break;
      case 8:
        loads.net(r.integer(1, std::min(rest, 20)));
        break;
      default:
        machines.flexible();
      }
    }
  }

  void decorate(Builder &b, Loads &loads)
  {
    const int forces = (int)(r.uniform(0, 1) * (2 + 0.4 * b.bodies()));
    for (int k = 0; k < forces; k++) loads.any();
    if (r.chance(0.35))
      for (int k = r.integer(1, 3); k > 0; k--) loads.drive();
  }

  void observe(Builder &b, Machines &machines, Loads &loads, Model &m)
  {
    Scene    &s    = *m.scene;
    const int step = std::max(1, b.bodies() / 10), components = b.planar ? 2 : 3;
    auto      look = [&](const Measure &what, Observed kind) {
      s.channel("c" + std::to_string(m.observed.size()), what);
      m.observed.push_back(kind);
    };
    for (int k = 1; k <= b.bodies(); k += step) {
      const Marker at = b.at(k, b.on(k));
      for (int c = 0; c < components; c++) look(Measure::displacement(at, c), Observed::Position);
      for (int c = 0; c < components; c++) look(Measure::velocity(at, c), Observed::Velocity);
    }
    for (Body f : machines.modal) look(Measure::modal(f, 0), Observed::Position);
    for (State x : loads.states) look(Measure::value(x), Observed::Position);
    int seen = 0;
    for (std::size_t k = 0; k < DataOf(s).elements.size() && seen < 4;
         k += std::max<std::size_t>(1, DataOf(s).elements.size() / 8))
      if (DataOf(s).elements[k].kind != ElementData::Force && std::strcmp(DataOf(s).elements[k].type, "attachment")) {
        for (int c = 0; c < components; c++)
          look(Measure::jointForce(Element{(PetscInt)k}, c, b.at(0, Vector3::Zero())), Observed::Reaction);
        seen++;
      }
    look(Measure::kineticEnergy(), Observed::Energy);
    look(Measure::potentialEnergy(), Observed::Energy);
  }

  void addExtras(Builder &b)
  {
    if (!extras_) return;
    std::swap(r, extra_);
    Extras extras(b);
    for (int k = r.integer(1, 4); k > 0; k--) extras.any();
    std::swap(r, extra_);
  }

  /* Adds switches to two of five models, at the end and with a separate random generator */
  void addSwitches(Builder &b, Model &m)
  {
    if (!switches_ || !later_.chance(0.4)) return;
    std::swap(r, later_);
    Switches switches(b, m.end);
    for (int k = r.integer(1, 3); k > 0; k--) switches.any();
    std::swap(r, later_);
    for (Marker at : switches.seen)
      for (int kind = 0; kind < 2; kind++)
        for (int c = 0; c < (b.planar ? 2 : 3); c++) {
          m.scene->channel("c" + std::to_string(m.observed.size()),
                           kind ? Measure::velocity(at, c) : Measure::displacement(at, c));
          m.observed.push_back(kind ? Observed::Velocity : Observed::Position);
        }
    m.switched = true;
    m.jump     = b.weightPerMass();
    m.impact   = switches.impact;
    b.lossy    = true;
  }

  /* whether it contains elements that dissipate or supply energy by their type; the builder knows springs with damping */
  static bool dissipates(const Scene &s)
  {
    static const char *const takes[] = {"motion", "friction", "user", "beam", "contact", "stop", "nonlinear", "attachment"};
    for (const ElementData &e : DataOf(s).elements)
      for (const char *word : takes)
        if (std::strstr(e.type, word)) return true;
    return false;
  }

  void count(Builder &b, Model &m)
  {
    m.types = b.used;
    for (const ElementData &e : DataOf(*m.scene).elements) m.types[e.type]++;
    if (!DataOf(*m.scene).variables.empty()) m.types["variable"] += (int)DataOf(*m.scene).variables.size();
    if (!DataOf(*m.scene).states.empty()) m.types["first-order state"] += (int)DataOf(*m.scene).states.size();
    m.types[m.planar ? "planar scene" : "spatial scene"]++;
  }
};

} // namespace soak

#endif
