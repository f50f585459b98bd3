/* SPDX-License-Identifier: GPL-3.0-or-later
 * Fibrolite inside a slicer or a printer's software: model and recipe in, pixels of any layer or tile out, into the
 * caller's memory. No file is needed and no mesh of the interior is made. The first part of this header is C, the
 * second C++; both answer with the same pixels. What is behind it may change; this header only grows.
 */
#ifndef FIBROLITE_SLICER_H
#define FIBROLITE_SLICER_H

/* NOLINTBEGIN(modernize-*, readability-identifier-naming): this part is C. */
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/** What every function returns. The numbers are the exit codes of the program and stay. */
typedef enum fibrolite_code {
  FIBROLITE_OK = 0,
  FIBROLITE_BAD_ARGUMENT = 2, /**< A null pointer, a layer or tile that is not there, a stride below the width, an `up`
                                 that is none, a job not open or opened twice. Nothing was done. */
  FIBROLITE_BAD_INPUT = 3,    /**< The model is missing, unreadable or not a solid. */
  FIBROLITE_BAD_RECIPE = 4,   /**< Recipe, preset, infill, or a number of the options. */
  FIBROLITE_TOO_LARGE = 5,    /**< It does not fit the memory given, or there is none left. */
  FIBROLITE_SOLVER_FAILED = 6,
  FIBROLITE_IO = 7,
  FIBROLITE_INTERNAL = 70,  /**< A bug of ours. */
  FIBROLITE_CANCELLED = 130 /**< fibrolite_job_cancel() was called. */
} fibrolite_code;

typedef enum fibrolite_up {
  FIBROLITE_UP_Z = 0,
  FIBROLITE_UP_X,
  FIBROLITE_UP_Y,
  FIBROLITE_UP_MINUS_X,
  FIBROLITE_UP_MINUS_Y,
  FIBROLITE_UP_MINUS_Z
} fibrolite_up;

/** A model in memory, in units of options.unit_mm; copied while it is opened. Corners may be repeated, they are welded.
 * No coordinate may be infinite or none, no corner beyond vertex_count: FIBROLITE_BAD_INPUT names the first. */
typedef struct fibrolite_mesh {
  const float* vertices; /**< x, y, z of each. */
  size_t vertex_count;
  const uint32_t* triangles; /**< Three vertices each, counter-clockwise seen from outside. */
  size_t triangle_count;
} fibrolite_mesh;

/** Zero or NULL in any field is the default; `fibrolite_options options = {0};` is a whole set of them. Lengths are mm,
 * finite and above zero, else FIBROLITE_BAD_RECIPE. Nothing of it is needed any more once the job is open. */
typedef struct fibrolite_options {
  const char* recipe;      /**< JSON, what `fibrolite recipe` prints or a part of it; laid over the preset. */
  const char* preset;      /**< "default". */
  const char* infill;      /**< The preset's, "hybrid" nearly always; or tcs, mfs, gyroid, shell, solid. */
  fibrolite_up up;         /**< Layers lie across it; it is also where loads come from. */
  double unit_mm;          /**< Millimetres per unit of the model; default: what the file says, else 1. */
  double size_mm;          /**< Scale the longest side to this; default: leave it. */
  double voxel_mm;         /**< Of the body and of the check that all is one piece; default: chosen. */
  double pixel_x_mm;       /**< Default 0.05. */
  double pixel_y_mm;       /**< Default: as pixel_x_mm. */
  double layer_mm;         /**< Default 0.05. */
  int planes;              /**< Heights a layer is sampled at, 1 to 16; default 1. */
  double max_memory_bytes; /**< A solid that needs more is made slab by slab; ask for its layers in order, for each
                              change of slab takes as long as making it. Refused if no slab fits. Default: no limit. */
} fibrolite_options;

/** What an open job holds. Pixel (0, 0) of layer 0 has its lower corner at `origin`; z along `up`. Pixel (x, y) of
 * layer n covers x to x + 1 pixel_x_mm, y to y + 1 pixel_y_mm and n to n + 1 layer_mm from there along the axes. */
typedef struct fibrolite_layers {
  int layers, width, height; /**< Their number, and the pixels of each. */
  double layer_mm, pixel_x_mm, pixel_y_mm;
  double origin[3];                       /**< mm, in the model's frame. */
  double axis_x[3], axis_y[3], axis_z[3]; /**< Unit vectors of the layers' x, y and z in the model's frame. */
  double volume_mm3;                      /**< mm3, of the solid, as measured on its voxels. */
} fibrolite_layers;

typedef struct fibrolite_job fibrolite_job; /**< A model being filled, then layers to ask for. */

/** `fraction` 0 to 1, never falling, 1 at the end; from any thread, one call at a time. `stage` is valid during the
 * call. It must not throw, nor free the job; it may cancel it. */
typedef void (*fibrolite_progress)(double fraction, const char* stage, void* user);

/** NULL if there is no memory left. `progress` may be NULL; `user` is handed to it and not looked at. */
fibrolite_job* fibrolite_job_new(fibrolite_progress progress, void* user);
/** Fill the model: seconds to minutes, on all cores. Once per job, whatever came of it: after a failure free the job
 * and make another. `options` may be NULL. Jobs may be opened at the same time. */
int fibrolite_job_open_mesh(fibrolite_job* job, const fibrolite_mesh* mesh, const fibrolite_options* options);
/** The same from a file: .stl .obj .ply .off .3mf; FIBROLITE_BAD_INPUT if it cannot be read. */
int fibrolite_job_open_file(fibrolite_job* job, const char* path, const fibrolite_options* options);
/** What there is to ask for. From any thread, once the job is open. */
int fibrolite_job_layers(const fibrolite_job* job, fibrolite_layers* layers);
/** A tile of a layer: pixel (x, y) goes to rows[(y - y0) * stride + x - x0] as 0 empty to 255 full, so rows follow each
 * other along axis_y: turn them round for a picture whose first row is its top. `stride` in bytes, `width` or more;
 * `rows` holds (height - 1) * stride + width of them, and what lies between rows is left as it is. A tile's bytes are
 * those of the whole layer at that place. `area_mm2` gets the tile's material in mm2, before it is rounded to 255
 * steps; it may be NULL. Any number of threads may ask at once, for the same layer or others, tasks of TBB among them;
 * one call alone uses all cores too. With max_memory_bytes who asks for another slab waits for those at work on this
 * one; who asks for the slab that is there goes first, as long as making it took, then who waited longest. The call may
 * also fail with FIBROLITE_TOO_LARGE. After FIBROLITE_CANCELLED the rows are part done. */
int fibrolite_job_tile(const fibrolite_job* job, int layer, int x0, int y0, int width, int height, uint8_t* rows,
                       size_t stride, double* area_mm2);
/** From any thread, a signal handler or `progress`, at any time: what runs returns FIBROLITE_CANCELLED within a second,
 * and so does all that is asked later. NULL is fine. */
void fibrolite_job_cancel(const fibrolite_job* job);
/** After the last call has returned. NULL is fine. */
void fibrolite_job_free(fibrolite_job* job);
/** One line of text, up to 1023 bytes, about the last call of this thread that did not return FIBROLITE_OK: WHAT
 * (WHERE); TRY. Empty if none. Valid until this thread's next such call. Never NULL. */
const char* fibrolite_last_message(void);

#ifdef __cplusplus
} /* extern "C" */
/* NOLINTEND(modernize-*, readability-identifier-naming) */

#include <limits>
#include <memory>

#include "fibrolite/context.h"
#include "fibrolite/mesh_io.h"
#include "fibrolite/ops/hybridize.h"
#include "fibrolite/ops/prepare.h"
#include "fibrolite/ops/report.h"
#include "fibrolite/slice.h"

namespace fibrolite {

struct SlicerParams {
  HybridizeParams fill;   ///< Recipe, infill, voxel. Loads come from `up`.
  PrepareParams prepare;  ///< Unit, size.
  Up up = Up::Z;          ///< Layers lie across it.
  Vec2d pixel_mm{0.05, 0.05};
  double layer_mm = 0.05;
  SliceParams slice;
  /// A solid predicted to need more is made slab by slab, each when a layer in it is asked for; refused if none fits.
  double max_memory_bytes = std::numeric_limits<double>::infinity();
};
/// A filled model, ready for any layer. Cheap to copy; everything may be called from several threads at once. In slabs
/// whoever asks for another slab waits for those at work on this one, so layers are best asked for in order; who asks
/// for the one that is there goes first, as long as making it took, then who waited longest.
class Slicer {
 public:
  /// Prepares and fills: the same layers as `fibrolite slice` makes of the same numbers.
  /// @throws Error of prepare(), hybridize() and slice_grid(); TooLarge: max_memory_bytes. Cost: that of hybridize().
  explicit Slicer(const MeshFile& model, const SlicerParams& params = {}, const Context& context = {});

  [[nodiscard]] const SliceGrid& grid() const;
  /// Of the fill; its volume is that of the solid, its mesh block is empty.
  [[nodiscard]] const Report& report() const;
  /// A whole layer. @throws Error BadRecipe: there is no such layer.
  [[nodiscard]] Slice layer(int number) const;
  /// A tile into the caller's rows, as slice_into(). Returns its area, mm2. @throws Error of slice_into(); BadRecipe:
  /// no such layer.
  [[nodiscard]] double tile(int layer, const PixelRange& tile, std::uint8_t* rows, std::ptrdiff_t stride,
                            const Context& context = {}) const;

 private:
  struct Filled;
  std::shared_ptr<Filled> filled_;
};

}  // namespace fibrolite
#endif /* __cplusplus */

#endif /* FIBROLITE_SLICER_H */
