/*
  Transforms matrix contributions at attachments' frames to the coordinates of their flexible bodies. Elements add to blocks whose rows are the (force, moment) on a frame
  and whose columns are its motion (x, theta, v, w, a, alpha). With this motion y and the body's position, angles and modes q

    dy = D dq,    generalized force  Q = L^T (f, m),    matrix  L^T K D + d(L^T (f, m))/dq for fixed (f, m)

  where D contains the dependence of rates and accelerations on the coordinates (sv, sa), and L is its part (x, theta) without it. The products with the modes are computed once for
  all elements between two frames, or between a frame and a group of unknowns; for frames of the same body they are collected and added with its own matrix.
*/
#ifndef HHTDAE_SCENE_PROJECTION_H
#define HHTDAE_SCENE_PROJECTION_H

#include "batch.h"
#include <map>

namespace hhtdae
{

class Projection
{
public:
  /* requests the blocks of the bodies, after all elements have requested theirs */
  void pattern(Pattern &p, const Bodies &B);
  void resolve(Pattern &p);
  bool empty() const { return of_.empty() && carriers_ == 0; }

  /* to be called before and after the elements add to the matrix; finish() needs the complete loads on frames, and the bodies' own blocks are added after it */
  void begin(Sink &s);
  void finish(Evaluation &e);

private:
  using Wide  = Eigen::Matrix<double, Eigen::Dynamic, 6>;
  using Block = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;
  struct Pair { /* a block whose rows, columns or both belong to a frame, the others to a group of unknowns */
    PetscInt    row_frame = -1, column_frame = -1, row_group = -1, column_group = -1;
    PetscInt    rows = 0, columns = 0;
    std::size_t at    = 0; /* first entry in array_ */
    std::size_t first = 0; /* its first slot, if it has any */
  };
  /* sum over all pairs of frames of a body: `rigid` is its first six coordinates, `motion` the motions of attachments, in the order of the columns of Carrier::shapes */
  struct Core {
    Matrix<6, 6>                               rigid;
    Eigen::MatrixXd                            rigid_motion, motion_rigid;    /* rows, columns */
    Eigen::MatrixXd                            rigid_bend[2], motion_bend[2]; /* with columns of Carrier::bend, bend_rate; geometric stiffening alone */
    bool                                       bends[2];
    std::map<std::pair<int, int>, std::size_t> place; /* in `motion`, of pairs of attachments in both orders */
    std::vector<Matrix<6, 6>>                  motion;
  };
  std::vector<Pair>                                                      pairs_;
  std::vector<std::pair<PetscInt, Slot>>                                 of_;      /* what elements asked for, and where it is in the array */
  std::vector<PetscInt>                                                  request_; /* blocks of the matrix */
  std::vector<Slot>                                                      slot_;
  std::vector<double>                                                    array_;
  std::vector<Core>                                                      cores_; /* of carriers */
  std::size_t                                                            carriers_      = 0;
  bool                                                                   accelerations_ = false;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> wide_; /* scratch */
  Eigen::MatrixXd                                                        left_, right_, packed_;

  Block       block(const Pair &p) const { return {array_.data() + p.at, p.rows, p.columns}; }
  void        geometric(const Evaluation &e, std::size_t carrier);
  void        addColumns(Evaluation &e, const Pair &p);
  void        addRows(Evaluation &e, const Pair &p);
  void        addBoth(Evaluation &e, const Pair &p);
  void        collect(const Evaluation &e, const Pair &p);
  void        deliver(Evaluation &e, std::size_t carrier);
  static void addTo(Eigen::MatrixXd &right, const Carrier &c, int k, int l, const Matrix<6, 6> &D);
  void        addUnsymmetric(const Carrier &c, const Core &core, ModalPart &p);
  void        byModes(const Eigen::MatrixXd &shapes, const Carrier &c, int k, const Wide &by_motion, int m, bool more);
  void        addModalColumns(Evaluation &e, const Slot &s, const Carrier &c, int k, const Wide &by_motion, const Wide *by_bend);
};

} // namespace hhtdae

#endif
