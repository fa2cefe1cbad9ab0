#include "transitions/catalogue.hpp"

#include "graph/errors.hpp"
#include "transitions/composite/attenuated_sum.hpp"
#include "transitions/composite/back_to_front.hpp"
#include "transitions/composite/binary_tree.hpp"
#include "transitions/composite/binary_tree_front_to_back.hpp"
#include "transitions/composite/classify.hpp"
#include "transitions/composite/front_to_back.hpp"
#include "transitions/filter/backward.hpp"
#include "transitions/filter/ball_sequence.hpp"
#include "transitions/filter/forward.hpp"
#include "transitions/filter/fourier.hpp"
#include "transitions/filter/fourier_levels.hpp"
#include "transitions/filter/median.hpp"
#include "transitions/filter/prefilter.hpp"
#include "transitions/filter/recursive.hpp"
#include "transitions/filter/running.hpp"
#include "transitions/filter/runs.hpp"
#include "transitions/filter/separable.hpp"
#include "transitions/filter/van_herk.hpp"
#include "transitions/kernels/targets.hpp"
#include "transitions/net/spread.hpp"
#include "transitions/project/adaptive_cast.hpp"
#include "transitions/project/adaptive_quadrature.hpp"
#include "transitions/project/combine.hpp"
#include "transitions/project/depth.hpp"
#include "transitions/project/distance_cast.hpp"
#include "transitions/project/front_cast.hpp"
#include "transitions/project/hull_cast.hpp"
#include "transitions/project/importance_cast.hpp"
#include "transitions/project/label_cast.hpp"
#include "transitions/project/octree_cast.hpp"
#include "transitions/project/parallel_product.hpp"
#include "transitions/project/preintegrated_quadratic_cast.hpp"
#include "transitions/project/ray_cast.hpp"
#include "transitions/project/shear_warp.hpp"
#include "transitions/project/shear_warp_perspective.hpp"
#include "transitions/project/shear_warp_perspective_runs.hpp"
#include "transitions/project/shear_warp_runs.hpp"
#include "transitions/project/sliced_runs.hpp"
#include "transitions/project/sorted_bricks.hpp"
#include "transitions/project/sorted_mip.hpp"
#include "transitions/project/splat.hpp"
#include "transitions/project/splat_ewa.hpp"
#include "transitions/project/splat_ewa_sheets.hpp"
#include "transitions/project/splat_ordered.hpp"
#include "transitions/project/splat_sheets.hpp"
#include "transitions/project/trapezoid_cast.hpp"
#include "transitions/radon/backward.hpp"
#include "transitions/radon/forward.hpp"
#include "transitions/radon/fourier.hpp"
#include "transitions/radon/hough_backward.hpp"
#include "transitions/radon/hough_forward.hpp"
#include "transitions/radon/inverse.hpp"
#include "transitions/shade/classify.hpp"
#include "transitions/shade/gradient.hpp"
#include "transitions/shade/runs.hpp"
#include "transitions/spectrum/faded_picture.hpp"
#include "transitions/spectrum/forward.hpp"
#include "transitions/spectrum/from_kspace.hpp"
#include "transitions/spectrum/gradients.hpp"
#include "transitions/spectrum/hartley.hpp"
#include "transitions/spectrum/inverse.hpp"
#include "transitions/spectrum/lit_slice.hpp"
#include "transitions/spectrum/moment_slice.hpp"
#include "transitions/spectrum/moments.hpp"
#include "transitions/spectrum/polar.hpp"
#include "transitions/spectrum/slice.hpp"
#include "transitions/store/crop.hpp"
#include "transitions/store/octree.hpp"
#include "transitions/store/precision.hpp"
#include "transitions/store/reduce.hpp"
#include "transitions/surface/draw.hpp"
#include "transitions/surface/flying_edges.hpp"
#include "transitions/surface/nets.hpp"
#include "transitions/warp/axis_permutation.hpp"
#include "transitions/warp/backward.hpp"
#include "transitions/warp/permutation.hpp"
#include "transitions/warp/phase_shears.hpp"
#include "transitions/warp/phase_shift.hpp"
#include "transitions/warp/scale.hpp"
#include "transitions/warp/shear.hpp"
#include "transitions/warp/spectrum_resample.hpp"

namespace edgewise {

Catalogue catalogue() {
    if (const std::string lacks = kernels::processor_lacks(); !lacks.empty()) throw RunError(lacks);
    return {
        // Preparations, in the order in which they apply: what is cropped away need not be
        // converted,
        // and no transform gains from samples that were made coarser before it.
        spectrum_from_kspace(),
        spread_over_ranks(),
        crop(),
        spline_prefilter_edge(),
        spectrum_forward(),
        spectrum_wide(),
        spectrum_hartley(),
        spectrum_moments(),
        spectrum_gradients(),
        spectrum_polar(),
        precision(),
        gradient_facet(),
        visible_runs(),
        sliced_runs(),
        sorted_bricks(),
        octree(),
        shade_classify(),
        shade_materials(),
        reduce(),
        reduce_colored(),
        // To the screen. Exact copies first: they win ties.
        axis_permutation_warp(),
        backward_warp(),
        colored_warp(),
        scaling(),
        permutation_warp(),
        shear_warp_passes(),
        phase_shift(),
        phase_shears(),
        spectrum_resample(),
        combine(),
        parallel_product(),
        composite_colored(),
        ray_cast(),
        gradient_cast(),
        preintegrated_cast(),
        preintegrated_quadratic_cast(),
        trapezoid_cast(),
        sorted_mip(),
        adaptive_cast(),
        octree_cast(),
        distance_cast(),
        importance_cast(),
        adaptive_quadrature(),
        hull_cast(),
        front_cast(),
        level_cast(),
        label_cast(),
        depth_cast(),
        depth_light(),
        shear_warp(),
        shear_warp_perspective(),
        shear_warp_perspective_runs(),
        shear_warp_runs(),
        splat(),
        splat_ewa(),
        splat_sheets(),
        splat_ordered(),
        splat_ewa_sheets(),
        // Appendix B: what project.combine does in one pass, in two.
        classify(),
        back_to_front_over(),
        front_to_back_over(),
        binary_tree_over(),
        binary_tree_front_to_back_over(),
        attenuated_sum(),
        spectrum_slice(),
        spectrum_inverse(),
        spectrum_polar_slice(),
        spectrum_moment_slice(),
        spectrum_lit_slice(),
        spectrum_faded_picture(),
        // Filters.
        filter_backward(),
        filter_forward(),
        filter_separable(),
        filter_running(),
        filter_recursive(),
        filter_fourier(),
        filter_fourier_levels(),
        filter_runs(),
        filter_van_herk(),
        filter_ball_sequence(),
        filter_median(),
        filter_median_histogram(),
        // To lines.
        radon_backward(),
        radon_forward(),
        radon_fourier(),
        hough_forward(),
        hough_backward(),
        radon_inverse(),
        // To surfaces.
        flying_edges_edge(),
        surface_nets_edge(),
        draw_edge(),
    };
}

}  // namespace edgewise
