/* Events of -log_view, registered in hht3.cpp. */
#ifndef HHTDAE_EVENTS_H
#define HHTDAE_EVENTS_H

#include <petscsys.h>

namespace hht3
{

struct Events {
  PetscLogEvent start, predict, matrix, estimate, sample;
};
extern Events events;

} // namespace hht3

#endif
