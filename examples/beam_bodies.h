/* A solid beam in a scene, modelled in three ways: the whole finite-element model, its modes, or two-node beams between rigid bodies. */
#ifndef HHTEX_BEAM_BODIES_H
#define HHTEX_BEAM_BODIES_H

#include "beam_mesh.h"

#include <memory>

namespace hhtex
{

/* Bodies at the ends of the beam, for joints and channels; at the start they have the space axes */
struct BeamEnds {
  hhtdae::Body root, tip;
};

/* The root is tied rigidly; the tip is the mean motion of its face, or also tied rigidly */
inline std::vector<hhtdae::Attachment> BeamAttachments(hhtdae::Tie tip = hhtdae::Tie::Average)
{
  std::vector<hhtdae::Attachment> ends(2);
  ends[0].name = "root";
  ends[1].name = "tip";
  ends[1].tie  = tip;
  return ends;
}

/* The full model keeps a reference to model */
inline PetscErrorCode AddFullBeam(hhtdae::Scene &scene, const hhtdae::FeModel &model, hhtdae::FeLaw law,
                                  hhtdae::FullFeBody *fe, BeamEnds *ends, hhtdae::Tie tip = hhtdae::Tie::Average)
{
  hhtdae::FullBody body;
  PetscFunctionBegin;
  body.law         = law;
  body.attachments = BeamAttachments(tip);
  PetscCall(fe->add(scene, "beam", model, body));
  *ends = {fe->attachment("root"), fe->attachment("tip")};
  PetscFunctionReturn(0);
}

/* Craig-Bampton modes (constraint modes of the attachments and normal modes), with or without geometric stiffening. A beam of several
   parts in a row is a chain of bodies, each with the modes of the model of one part. */
inline PetscErrorCode AddModalBeam(hhtdae::Scene &scene, const hhtdae::FeModel &part, double length, int parts,
                                   PetscInt modes, BeamEnds *ends, hhtdae::Tie tip = hhtdae::Tie::Average, bool stiffening = false)
{
  hhtdae::Reduction   reduction;
  hhtdae::ReducedBody reduced;
  PetscBool           page;
  PetscFunctionBegin;
  PetscCall(PetscOptionsHasName(nullptr, nullptr, "-scene_page", &page));
  reduction.attachments = BeamAttachments(parts > 1 ? hhtdae::Tie::Rigid : tip);
  reduction.modes       = modes;
  reduction.all_nodes   = page;
  reduction.stiffening  = stiffening;
  PetscCall(hhtdae::Reduce(part, reduction, &reduced));
  auto surface = std::make_shared<hhtdae::Surface>();
  if (page) { /* the page shows the deformed beam, coloured by stress */
    PetscCall(hhtdae::AddStressModes(part, &reduced));
    PetscCall(hhtdae::MakeSurface(reduced, surface.get()));
  }
  hhtdae::FlexibleBody body;
  body.model = std::make_shared<hhtdae::ModalBody>(reduced.modal);
  for (int k = 0; k < parts; k++) {
    body.position             = {k * length, 0, 0};
    const std::string  number = parts > 1 ? " " + std::to_string(k) : "";
    const hhtdae::Body member = scene.add("beam" + number, body), root = scene.attachment(member, "root");
    if (page) scene.surface(member, surface);
    if (k == 0)
      ends->root = root;
    else
      scene.add("weld" + number, hhtdae::Fixed{scene.marker(root), scene.marker(ends->tip)});
    ends->tip = scene.attachment(member, "tip");
  }
  PetscFunctionReturn(0);
}

/* The mass is lumped at the nodes: each piece gives half of its mass to either end */
inline void AddBeamElements(hhtdae::Scene &scene, const SolidBeam &beam, int pieces, BeamEnds *ends)
{
  const double   l = beam.length / pieces, rho = beam.material.density;
  hhtdae::Marker last;
  for (int k = 0; k <= pieces; k++) {
    const double      part = k == 0 || k == pieces ? l / 2 : l;
    hhtdae::RigidBody node;
    node.mass     = rho * beam.area() * part;
    node.inertia  = (rho * part * hhtdae::Vector3(beam.Iyy() + beam.Izz(), beam.Iyy(), beam.Izz())).asDiagonal();
    node.position = {k * l, 0, 0};
    const hhtdae::Body   body = scene.add("node " + std::to_string(k), node);
    const hhtdae::Marker here = scene.marker(body);
    if (k == 0) ends->root = body;
    ends->tip = body;
    if (k > 0) {
      hhtdae::Beam piece;
      piece.i       = here;
      piece.j       = last;
      piece.length  = l;
      piece.E       = beam.material.young;
      piece.G       = beam.shearModulus();
      piece.area    = beam.area();
      piece.Iyy     = beam.Iyy();
      piece.Izz     = beam.Izz();
      piece.J       = beam.torsion();
      piece.shear_y = piece.shear_z = 5. / 6 * beam.area();
      scene.add("piece " + std::to_string(k), piece);
    }
    last = here;
  }
}

} // namespace hhtex

#endif
