/* Orders above two: history, stage and changes of order (bdf.cpp; the formulas are in bdf.h), error and choice of the order (order.cpp). */
#ifndef HHTDAE_ORDER_H
#define HHTDAE_ORDER_H

#include "integrator/state.h"

namespace hht3
{

PetscErrorCode SetUpOrder(TS ts);
PetscErrorCode ViewOrder(TS ts, PetscViewer viewer);

/* At a start: order two, no history */
void ResetOrder(TS ts);

/* Before an attempt of length I.h: sets the parameters of its order, and prepares a change from or to order two; then PrepareStage()
   of orders above two */
PetscErrorCode UseOrder(TS ts);
PetscErrorCode PrepareBDF(TS ts);

/* tau_j = t1 - t_{n+1-j}, j = 1, 2, ..., of a step to t1, as far as the history reaches */
void Spans(const Order &o, PetscReal t1, PetscReal tau[]);

/* The local error of an attempt of order above two, in units of the tolerance */
PetscErrorCode ErrorOfOrder(TS ts, NormType type, PetscReal *wlte);

/* Chooses the order of the step after the accepted one. *next: on entry the step size that the controller has chosen for the present
   order, on return the one for the chosen order; NULL if a TSAdapt other than "hhtdae" chooses it. */
PetscErrorCode ChooseOrder(TS ts, PetscReal *next);

/* Called before the end of the accepted step becomes t_n: puts its beginning into the past and makes o.next the order */
void CommitOrder(Integrator &I);

/* Lowers the order to two for some steps: at once, after a failed corrector iteration, or from the next step on */
PetscErrorCode LowerAfterFailure(TS ts);
void           LowerToTwo(Order &o);

/* Keeps only n states of the past; maps the past to new coordinates */
PetscErrorCode CutPast(TS ts, PetscInt n);
PetscErrorCode MapPast(TS ts);

} // namespace hht3

#endif
