/* Channels. The rank that owns the first body of a channel's measure evaluates it. */
#ifndef HHTDAE_SCENE_OUTPUT_CHANNELS_H
#define HHTDAE_SCENE_OUTPUT_CHANNELS_H

#include "scene/runtime.h"

namespace hhtdae
{

/* Ranks that evaluate the channels which existed when the scene was set up */
const std::vector<PetscMPIInt> &ChannelOwners(const Runtime &R);
/* Whether a channel depends on accelerations or multipliers, so that samples need TSHHT3EvaluateAt() instead of TSHHT3Interpolate() */
bool ChannelsFollowFromEquations(const Runtime &R);
/* Appends the values of own channels in the state of e, in the order of the channels; collective */
PetscErrorCode ChannelValues(const Runtime &R, const Evaluation &e, std::vector<double> &values);

} // namespace hhtdae

#endif
