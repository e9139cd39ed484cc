/*
  Transforms matrix contributions at attachments' frames to the coordinates of their flexible bodies. Elements add to blocks whose rows are the (force, moment) on a frame
  and whose columns are the motion y = (x, theta, v, w, a, alpha) of a frame. With the body's coordinates q (position, angles, modes)

    dy = D dq,    generalized force  Q = L^T (f, m),    matrix  L^T K D + d(L^T (f, m))/dq for fixed (f, m)

  where D includes the derivatives by velocities and accelerations times sv and sa, and L = d(x, theta)/dq. The products with
  the modes are computed once for all elements between two frames, or between a frame and a group of unknowns. For two frames
  of the same body they are collected in a Core and added together with the body's own matrix.
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
  /* Requests the blocks of the flexible bodies' coordinates; called after all elements have requested their blocks */
  void pattern(Pattern &p, const Bodies &B);
  void resolve(Pattern &p);
  bool empty() const { return of_.empty() && carriers_ == 0; }

  /* begin() is called before, finish() after the elements add to the matrix. finish() needs the complete loads on frames;
     the bodies' own blocks are added after it */
  void begin(Sink &s);
  void finish(Evaluation &e);

private:
  using Wide  = Eigen::Matrix<double, Eigen::Dynamic, 6>;
  using Block = Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>;
  struct Pair { /* a block whose rows, columns or both belong to a frame (*_frame >= 0); otherwise they belong to a group of unknowns */
    PetscInt    row_frame = -1, column_frame = -1, row_group = -1, column_group = -1;
    PetscInt    rows = 0, columns = 0;
    std::size_t at    = 0; /* first entry in array_ */
    std::size_t first = 0; /* number of its first slot in slot_; unused for two frames of the same body */
  };
  /* Sum over all pairs of frames of one body. `rigid`: by its first six coordinates; `motion`: by (xi, phi) of
     attachments, in the order of the columns of Carrier::shapes. The first word of a name is for the rows, the second for
     the columns. */
  struct Core {
    Matrix<6, 6>                               rigid;
    Eigen::MatrixXd                            rigid_motion, motion_rigid;    /* rows by columns */
    /* columns belong to those of Carrier::bend, bend_rate; only with geometric stiffening */
    Eigen::MatrixXd                            rigid_bend[2], motion_bend[2];
    bool                                       bends[2];
    std::map<std::pair<int, int>, std::size_t> place; /* place in `motion` of each pair of attachments (row, column); contains both orders */
    std::vector<Matrix<6, 6>>                  motion;
  };
  std::vector<Pair>                                                      pairs_;
  /* numbers of the elements' requests for blocks of frames, and the positions of these blocks in array_ */
  std::vector<std::pair<PetscInt, Slot>>                                 of_;
  std::vector<PetscInt>                                                  request_; /* numbers of requested blocks of the matrix */
  std::vector<Slot>                                                      slot_;
  std::vector<double>                                                    array_;
  std::vector<Core>                                                      cores_; /* one for each carrier */
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
