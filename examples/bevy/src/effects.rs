//! Plans and their pipelines, made off the render thread.

use bevy::ecs::prelude::{Query, Res, ResMut, Resource};
use bevy::log::warn;
use bevy::render::render_resource::TextureFormat;
use bevy::render::renderer::RenderDevice;
use bevy::render::view::ExtractedView;
use bevy::tasks::{AsyncComputeTaskPool, Task, futures::check_ready};
use subsurface::{Error, Plan, Profile, ScreenSpace};

use crate::{SubsurfaceProfiles, SubsurfaceScattering};

/// Effects that no camera uses are kept, up to this many, for those who toggle.
const UNUSED_KEPT: usize = 4;

/// What an effect is made for.
#[derive(Clone, Debug, PartialEq)]
struct Wish {
    profiles: Vec<Profile>,
    /// Bits, so that what is not a number equals itself and is refused once.
    max_error: u32,
}

#[derive(Debug)]
enum State {
    Making(Task<Result<ScreenSpace, Error>>),
    Ready(ScreenSpace),
    /// The device or the wish cannot be served; said once.
    Refused,
}

#[derive(Debug)]
struct Made {
    wish: Wish,
    state: State,
    is_used: bool,
}

/// The effects of all cameras.
#[derive(Resource, Debug, Default)]
pub(crate) struct Effects {
    /// From the first that was asked for to the last.
    made: Vec<Made>,
    /// What was wished for in the frame before.
    wishes: Vec<Wish>,
}

impl Effects {
    /// The effect for a camera: the one that it wishes for, or, until that is ready, the last one that has
    /// its profiles in the same places.
    pub(crate) fn get(
        &self,
        profiles: &SubsurfaceProfiles,
        settings: &SubsurfaceScattering,
    ) -> Option<&ScreenSpace> {
        let wish = Wish::new(profiles, settings);
        let ready = |made: &'_ Made| match &made.state {
            State::Ready(_) => wish.profiles.starts_with(&made.wish.profiles),
            _ => false,
        };
        let exactly = self.made.iter().find(|made| made.wish == wish && ready(made));
        let found = exactly.or_else(|| self.made.iter().rfind(|made| ready(made)))?;
        match &found.state {
            State::Ready(effect) => Some(effect),
            _ => None,
        }
    }
}

impl Wish {
    fn new(profiles: &SubsurfaceProfiles, settings: &SubsurfaceScattering) -> Self {
        Self { profiles: profiles.profiles().collect(), max_error: settings.max_error.to_bits() }
    }

    fn plan(&self) -> Result<Plan, Error> {
        let (profiles, max_error) = (&self.profiles, f32::from_bits(self.max_error));
        if max_error == 0.0 {
            return Plan::exact(profiles);
        }
        if *profiles == [Profile::SKIN] && max_error == subsurface::DEFAULT_MAX_ERROR {
            return Ok(Plan::skin()); // stored, so that it need not be fitted
        }
        match Plan::new(profiles, max_error) {
            Err(Error::MaxError { reachable, .. }) => Plan::new(profiles, reachable),
            plan => plan,
        }
    }
}

/// Has made what cameras wish for in two frames, one at a time, so that a slider that is dragged does not flood
/// the pool, and the first frame of a scene has it for itself.
pub(crate) fn make_effects(
    cameras: Query<&SubsurfaceScattering, bevy::ecs::prelude::With<ExtractedView>>,
    profiles: Res<SubsurfaceProfiles>,
    device: Res<RenderDevice>,
    mut effects: ResMut<Effects>,
) {
    let Effects { made, wishes } = &mut *effects;
    let before = std::mem::take(wishes);
    for made in made.iter_mut() {
        made.is_used = false;
        if let State::Making(task) = &mut made.state
            && let Some(result) = check_ready(task)
        {
            made.state = match result {
                Ok(effect) => State::Ready(effect),
                Err(error @ Error::Limit { .. }) => {
                    warn!(
                        "Nothing scatters: {error}. SubsurfaceScattering needs WebGPU, Vulkan, Metal or \
                         DirectX 12, and WgpuSettings that do not constrain their limits."
                    );
                    State::Refused
                }
                Err(error) => {
                    warn!("Nothing scatters: SubsurfaceScattering: {error}.");
                    State::Refused
                }
            };
        }
    }
    if profiles.profiles().next().is_none() {
        return;
    }
    for settings in &cameras {
        let wish = Wish::new(&profiles, settings);
        if let Some(made) = made.iter_mut().find(|made| made.wish == wish) {
            made.is_used = true;
            continue;
        }
        let is_busy = made.iter().any(|made| matches!(made.state, State::Making(_)));
        if !is_busy && before.contains(&wish) {
            let device = device.wgpu_device().clone();
            let of = wish.clone();
            let task = AsyncComputeTaskPool::get()
                .spawn(async move { ScreenSpace::new(&device, TextureFormat::Rgba16Float, &of.plan()?) });
            made.push(Made { wish, state: State::Making(task), is_used: true });
        } else {
            wishes.push(wish);
        }
    }
    let is_unused = |made: &Made| !made.is_used && !matches!(made.state, State::Making(_));
    let mut unused = made.iter().filter(|made| is_unused(made)).count();
    made.retain(|made| {
        let goes = unused > UNUSED_KEPT && is_unused(made);
        unused -= usize::from(goes);
        !goes
    });
}
