/* Channels, each on the rank that owns the first body of its measure. */
#ifndef HHTDAE_SCENE_OUTPUT_CHANNELS_H
#define HHTDAE_SCENE_OUTPUT_CHANNELS_H

#include "scene/runtime.h"

namespace hhtdae
{

/* of all channels, as they were when the scene was set up */
const std::vector<PetscMPIInt> &ChannelOwners(const Runtime &R);
/* Values of own channels in the state of e, appended in the order of the channels; collective */
/* Whether a channel depends on accelerations or multipliers: TSHHT3EvaluateAt() instead of TSHHT3Interpolate() */
bool ChannelsFollowFromEquations(const Runtime &R);
PetscErrorCode ChannelValues(const Runtime &R, const Evaluation &e, std::vector<double> &values);

} // namespace hhtdae

#endif
