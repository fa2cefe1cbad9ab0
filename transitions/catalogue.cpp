#include "transitions/catalogue.hpp"

#include "transitions/composite/attenuated_sum.hpp"
#include "transitions/composite/back_to_front.hpp"
#include "transitions/composite/binary_tree.hpp"
#include "transitions/composite/binary_tree_front_to_back.hpp"
#include "transitions/composite/classify.hpp"
#include "transitions/composite/front_to_back.hpp"
#include "transitions/filter/prefilter.hpp"
#include "transitions/net/spread.hpp"
#include "transitions/project/adaptive_cast.hpp"
#include "transitions/project/combine.hpp"
#include "transitions/project/depth.hpp"
#include "transitions/project/parallel_product.hpp"
#include "transitions/project/ray_cast.hpp"
#include "transitions/project/shear_warp.hpp"
#include "transitions/project/shear_warp_runs.hpp"
#include "transitions/project/sorted_bricks.hpp"
#include "transitions/project/sorted_mip.hpp"
#include "transitions/project/splat.hpp"
#include "transitions/project/splat_sheets.hpp"
#include "transitions/shade/classify.hpp"
#include "transitions/shade/gradient.hpp"
#include "transitions/shade/runs.hpp"
#include "transitions/spectrum/forward.hpp"
#include "transitions/spectrum/inverse.hpp"
#include "transitions/spectrum/slice.hpp"
#include "transitions/store/crop.hpp"
#include "transitions/store/precision.hpp"
#include "transitions/store/reduce.hpp"
#include "transitions/surface/draw.hpp"
#include "transitions/surface/flying_edges.hpp"
#include "transitions/surface/nets.hpp"
#include "transitions/warp/axis_permutation.hpp"
#include "transitions/warp/backward.hpp"
#include "transitions/warp/permutation.hpp"
#include "transitions/warp/scale.hpp"
#include "transitions/warp/shear.hpp"

namespace edgewise {

Catalogue catalogue() {
    return {
        // Preparations, in the order in which they apply: what is cropped away need not be
        // converted,
        // and no transform gains from samples that were made coarser before it.
        spread_over_ranks(),
        crop(),
        spline_prefilter_edge(),
        spectrum_forward(),
        precision(),
        gradient_facet(),
        visible_runs(),
        sorted_bricks(),
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
        combine(),
        parallel_product(),
        composite_colored(),
        ray_cast(),
        gradient_cast(),
        preintegrated_cast(),
        sorted_mip(),
        adaptive_cast(),
        level_cast(),
        depth_cast(),
        depth_light(),
        shear_warp(),
        shear_warp_runs(),
        splat(),
        splat_sheets(),
        // Appendix B: what project.combine does in one pass, in two.
        classify(),
        back_to_front_over(),
        front_to_back_over(),
        binary_tree_over(),
        binary_tree_front_to_back_over(),
        attenuated_sum(),
        spectrum_slice(),
        spectrum_inverse(),
        // To surfaces.
        flying_edges_edge(),
        surface_nets_edge(),
        draw_edge(),
    };
}

}  // namespace edgewise
